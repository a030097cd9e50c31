// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace corbot::rt {

/// Detects that the thread that serves the device stood still while the cycle went on. Meanwhile the arm may
/// have moved, or stopped in Error, and the device's next place is far from its last. It uses the thread's
/// own clock and the numbers of the cycle's frames. If both stand still, as with the whole machine, nothing
/// has gone on. The cycle itself detects a lasting standstill (StillWatch); this class detects one that has
/// ended earlier. Pure.
class Standstill {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// The longest time between two frames. It is longer than a device's replies in service may take, at most
  /// 0.3 s.
  static constexpr std::int64_t kLongest_ns = 1'000'000'000;

  /// `cycle`: number of the newest frame.
  void begin(Time now, std::uint64_t cycle) noexcept {
    at_ = now;
    cycle_ = cycle;
  }
  /// Called before each frame is sent, and after it was read. Returns the length of a standstill that is too
  /// long, if the cycle has worked for at least half of it.
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
