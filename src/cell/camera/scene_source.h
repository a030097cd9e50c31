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

/// No picture. The text names the source and what is wrong.
class SourceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A picture that was exposed after its trigger.
struct SourcePicture {
  double exposure_s{};                ///< middle of the exposure, Unix epoch
  std::span<const std::uint8_t> bgr;  ///< rows of pixels; valid until the next picture is taken
};

/// Takes pictures of the scene at its Unix socket: picture_wire.h. Each picture has a connection of its own, so no
/// late or cut reply of an earlier one is in its way. Not thread-safe.
class SceneSource {
 public:
  using Clock = std::chrono::steady_clock;

  /// Pictures of another size, columns and rows, are refused. Connects to nothing yet.
  SceneSource(std::filesystem::path socket, std::array<int, 2> size_px);

  /// Triggers a picture and waits for it. Throws SourceError: nothing listens, nothing came before the deadline,
  /// the reply is cut, or it is no picture of the right size that began after the trigger.
  [[nodiscard]] SourcePicture take(Clock::time_point deadline);

 private:
  std::filesystem::path socket_;
  std::array<int, 2> size_px_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace corbot::cell
