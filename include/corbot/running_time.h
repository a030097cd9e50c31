// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace corbot {

/// Measures the time that this process has run, judged by its own looks. At most `longest` of the time
/// between two looks counts. So a process that was frozen or starved, alone or with the whole machine, does
/// not blame another process. Nor does its own wait end before the expected event could happen.
class RunningTime {
 public:
  using Clock = std::chrono::steady_clock;

  RunningTime(Clock::duration longest, Clock::time_point now) : longest_(longest), looked_at_(now) {}

  /// Looks at the clock. Returns the time since the last restart, counted as above.
  Clock::duration look(Clock::time_point now) {
    passed_ += std::min(now - looked_at_, longest_);
    looked_at_ = now;
    return passed_;
  }
  void restart(Clock::time_point now) {
    passed_ = {};
    looked_at_ = now;
  }
  [[nodiscard]] Clock::duration passed() const { return passed_; }

 private:
  Clock::duration longest_;
  Clock::duration passed_{};
  Clock::time_point looked_at_;
};

/// The bound of a wait that polls every few milliseconds. It begins at construction.
class Patience {
 public:
  using Clock = RunningTime::Clock;
  /// The longest time between two looks without a fault: the time of another call's plan.
  static constexpr std::chrono::milliseconds kLongestLook{200};

  explicit Patience(std::chrono::duration<double> bound, Clock::time_point now = Clock::now())
      : bound_(bound), time_(kLongestLook, now) {}

  /// Looks at the clock. The caller tests its condition after this look, and gives up only if the test fails.
  [[nodiscard]] bool is_over(Clock::time_point now = Clock::now()) { return time_.look(now) > bound_; }

 private:
  std::chrono::duration<double> bound_;
  RunningTime time_;
};

}  // namespace corbot
