// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace corbot {

/// Time as this process has run it, judged by its own looks: of the time between two of them no more than `longest`
/// counts. A process that was frozen or starved, alone or with the whole machine, then finds no fault with another, and
/// no wait of its own is over before what it waits for could happen.
class RunningTime {
 public:
  using Clock = std::chrono::steady_clock;

  RunningTime(Clock::duration longest, Clock::time_point now) : longest_(longest), looked_at_(now) {}

  /// A look. Returns what has passed since the last restart, as above.
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

/// The bound of a wait that looks every few milliseconds. Begins when it is made.
class Patience {
 public:
  using Clock = RunningTime::Clock;
  /// Of what happens between two looks without a fault: another call's plan.
  static constexpr std::chrono::milliseconds kLongestLook{200};

  explicit Patience(std::chrono::duration<double> bound, Clock::time_point now = Clock::now())
      : bound_(bound), time_(kLongestLook, now) {}

  /// A look; what is waited for is to be tested after it, and given up only when that fails.
  [[nodiscard]] bool is_over(Clock::time_point now = Clock::now()) { return time_.look(now) > bound_; }

 private:
  std::chrono::duration<double> bound_;
  RunningTime time_;
};

}  // namespace corbot
