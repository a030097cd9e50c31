// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
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

/// Queries to a servo controller on a serial line, with time-outs for the replies. Failures throw
/// DeviceError.
class SerialDialog {
 public:
  using Clock = SerialLine::Clock;
  using Pulses = std::array<double, kMaxServos>;

  explicit SerialDialog(std::unique_ptr<SerialLine> line) : line_(std::move(line)) {}

  void open(const std::string& path, int baud);
  void close() noexcept { line_->close(); }
  /// Begins service: frames now wait for the replies, which get the line's time, and a little more.
  void begin_service() noexcept { is_in_service_ = true; }

  void write(std::span<const std::uint8_t> bytes);
  void write(std::string_view text);
  /// Reads all bytes; the deadline counts from the last write, which is the query.
  void read(std::span<std::uint8_t> into);
  void discard_input() { line_->discard_input(); }
  [[nodiscard]] std::optional<int> latency_ms() const { return line_->latency_ms(); }

  /// Records a valid reply.
  void note_reply() noexcept;
  /// Tells whether a valid reply has come since the last call.
  [[nodiscard]] bool take_replied() noexcept { return std::exchange(has_replied_, false); }
  /// Records a missing or invalid reply. It throws the error after every 150 ms without a good reply. So a
  /// line may be disturbed as long as the backend tolerates such errors. It throws any other error at once.
  void note_miss(const DeviceError& error);
  /// Returns positions that were alike twice in a row, except for a slow motion meanwhile; it tries a few
  /// times.
  [[nodiscard]] Pulses read_until_stable(std::size_t count, const std::function<Pulses()>& query) const;

 private:
  [[nodiscard]] std::chrono::nanoseconds duration(std::size_t bytes) const noexcept;

  const std::unique_ptr<SerialLine> line_;
  std::string path_;
  int baud_{115200};
  bool is_in_service_{false};
  bool has_replied_{false};
  Clock::time_point free_at_{};  ///< time when the line has sent everything written
  /// Time since a reply, or since a miss was reported. It takes several misses, even if this thread stands
  /// still between two.
  RunningTime silence_{std::chrono::milliseconds(60), {}};
};

}  // namespace corbot::rt
