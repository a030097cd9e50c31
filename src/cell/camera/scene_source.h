// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <vector>

namespace corbot::cell {

/// The source gave no picture. The text names the source and the cause.
class SourceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A picture that was exposed after its trigger.
struct SourcePicture {
  double exposure_s{};                ///< middle of the exposure, Unix epoch
  std::span<const std::uint8_t> bgr;  ///< rows of pixels; valid until the next picture is taken
};

/// Takes pictures of the scene at its Unix socket, by the protocol of picture_wire.h. Each picture uses a new
/// connection, so a late or truncated reply cannot belong to a previous picture. Not thread-safe.
class SceneSource {
 public:
  using Clock = std::chrono::steady_clock;

  /// Sets the only accepted size: columns and rows. Does not connect yet.
  SceneSource(std::filesystem::path socket, std::array<int, 2> size_px);

  /// Triggers a picture and waits for it. Throws SourceError if nothing listens, or if the deadline passes.
  /// Also throws if the reply is truncated, has the wrong size, or was exposed before the trigger.
  [[nodiscard]] SourcePicture take(Clock::time_point deadline);

 private:
  std::filesystem::path socket_;
  std::array<int, 2> size_px_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace corbot::cell
