// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "corbot/backend/backend.h"
#include "rt/backends/serial/serial_port.h"

namespace corbot::rt {

/// Questions to a servo controller on a serial line, and how long an answer may take. Failures throw
/// DeviceError.
class SerialDialog {
 public:
  using Clock = SerialLine::Clock;
  using Pulses = std::array<double, kMaxServos>;

  explicit SerialDialog(std::unique_ptr<SerialLine> line) : line_(std::move(line)) {}

  void open(const std::string& path, int baud);
  void close() noexcept { line_->close(); }
  /// From now on frames wait for the answers: they get the time that the line takes, and a little.
  void begin_service() noexcept { is_in_service_ = true; }

  void write(std::span<const std::uint8_t> bytes);
  void write(std::string_view text);
  /// Reads all of it; what was written last is thought to be the question.
  void read(std::span<std::uint8_t> into);
  void discard_input() { line_->discard_input(); }

  /// An answer made sense.
  void heard() noexcept;
  /// Whether one did since the last call.
  [[nodiscard]] bool take_heard() noexcept { return std::exchange(was_heard_, false); }
  /// An answer is missing, or makes no sense. Throws it after every 150 ms without a good one, so that a
  /// line may be disturbed for as long as the backend tolerates so many; any other error at once.
  void missed(const DeviceError& error);
  /// Positions that were told twice in a row, moving slowly meanwhile; asks for them a few times.
  [[nodiscard]] Pulses told_twice(std::size_t count, const std::function<Pulses()>& ask) const;

 private:
  [[nodiscard]] std::chrono::nanoseconds duration(std::size_t bytes) const noexcept;

  const std::unique_ptr<SerialLine> line_;
  std::string path_;
  int baud_{115200};
  bool is_in_service_{false};
  bool was_heard_{false};
  Clock::time_point free_at_{};   ///< the line has sent what was written
  Clock::time_point heard_at_{};  ///< or a miss was told
};

/// One that is missing or wrong may be noise on the line.
[[nodiscard]] inline bool is_noise(DeviceCause cause) noexcept {
  return cause == DeviceCause::kNoAnswer || cause == DeviceCause::kBadAnswer;
}

}  // namespace corbot::rt
