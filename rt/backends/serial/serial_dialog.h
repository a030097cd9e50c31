// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "corbot/backend/backend.h"
#include "corbot/running_time.h"
#include "rt/backends/serial/serial_port.h"

namespace corbot::rt {

/// Queries to a servo controller on a serial line, and how long a reply may take.
/// Failures throw DeviceError.
class SerialDialog {
 public:
  using Clock = SerialLine::Clock;
  using Pulses = std::array<double, kMaxServos>;

  explicit SerialDialog(std::unique_ptr<SerialLine> line) : line_(std::move(line)) {}

  void open(const std::string& path, int baud);
  void close() noexcept { line_->close(); }
  /// From now on frames wait for the replies: they get the time that the line takes, and a little.
  void begin_service() noexcept { is_in_service_ = true; }

  void write(std::span<const std::uint8_t> bytes);
  void write(std::string_view text);
  /// Reads all of it; the deadline counts from what was written last, as the query.
  void read(std::span<std::uint8_t> into);
  void discard_input() { line_->discard_input(); }
  [[nodiscard]] std::optional<int> latency_ms() const { return line_->latency_ms(); }

  /// A valid reply has come.
  void note_reply() noexcept;
  /// Whether one has since the last call.
  [[nodiscard]] bool take_replied() noexcept { return std::exchange(has_replied_, false); }
  /// A reply is missing or invalid. Throws it after every 150 ms without a good one, so that a line may be
  /// disturbed for as long as the backend tolerates so many; any other error at once.
  void note_miss(const DeviceError& error);
  /// Positions that were alike twice in a row, but for a slow motion meanwhile; a few tries.
  [[nodiscard]] Pulses read_until_stable(std::size_t count, const std::function<Pulses()>& query) const;

 private:
  [[nodiscard]] std::chrono::nanoseconds duration(std::size_t bytes) const noexcept;

  const std::unique_ptr<SerialLine> line_;
  std::string path_;
  int baud_{115200};
  bool is_in_service_{false};
  bool has_replied_{false};
  Clock::time_point free_at_{};  ///< the line has sent what was written
  /// Since a reply, or since a miss was reported. Several misses, however long this thread stands still
  /// between two.
  RunningTime silence_{std::chrono::milliseconds(60), {}};
};

}  // namespace corbot::rt
