// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace corbot::rt {

/// Whether the thread that serves the device has stood still while the cycle went on: since then the arm may have moved on,
/// or stopped in Error, and where the device is to be now is another place, not the next one. By the thread's own clock and
/// the numbers of the cycle's frames; where both stand still, as with the whole machine, nothing has gone on. The cycle
/// itself sees a thread that still stands (StillWatch); this one sees it when it goes on sooner. Pure.
class Standstill {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Between two frames. Longer than a device's answers in service may take, of which the longest is 0.3 s.
  static constexpr std::int64_t kLongest_ns = 1'000'000'000;

  /// `cycle`: of the newest frame.
  void begin(Time now, std::uint64_t cycle) noexcept {
    at_ = now;
    cycle_ = cycle;
  }
  /// Before each frame is sent, and after it was read. How long it has stood still, where that is too long and the cycle
  /// has worked for half of it at least.
  [[nodiscard]] std::optional<std::int64_t> look(Time now, std::uint64_t cycle,
                                                 std::int64_t cycle_period_ns) noexcept {
    const std::int64_t gap_ns = std::chrono::nanoseconds(now - at_).count();
    const std::uint64_t steps = cycle > cycle_ ? cycle - cycle_ : 0;
    begin(now, cycle);
    if (gap_ns <= kLongest_ns || cycle_period_ns <= 0) return std::nullopt;
    if (steps < static_cast<std::uint64_t>(gap_ns / cycle_period_ns) / 2) return std::nullopt;
    return gap_ns;
  }

 private:
  Time at_{};
  std::uint64_t cycle_{0};
};

}  // namespace corbot::rt
