// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "corbot/running_time.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// The state of an emergency stop input that is queried over a line, and its time-out without a good reply.
/// Pure: it is given the time.
class StopInputWatch {
 public:
  using Clock = RunningTime::Clock;
  /// The deadline, in time that this process ran; on a line with frames further apart it is two frames.
  static constexpr std::chrono::milliseconds kDeadline{100};
  /// The interval of queries while the input cannot be read. Frames, which bring the arm to rest, do not wait
  /// for it. A reply as late as this is no reply to an earlier query.
  static constexpr std::chrono::milliseconds kRetry{500};
  /// A short press is reported for this many looks, longer than any period of the cycle.
  static constexpr int kPressLasts = 5;

  /// Starts with a good reply, not pressed.
  void begin(Clock::time_point now) noexcept {
    silence_.restart(now);
    misses_ = 0;
    is_heard_ = true;
    looks_pressed_ = 0;
  }
  /// Tells whether to query now. A query must follow.
  [[nodiscard]] bool is_due(Clock::time_point now) noexcept {
    if (is_heard_) return true;
    if (now < retry_at_) return false;
    retry_at_ = now + kRetry;
    return true;
  }
  /// Records a good reply.
  void note(bool is_pressed, Clock::time_point now) noexcept {
    silence_.restart(now);
    misses_ = 0;
    is_heard_ = true;
    if (is_pressed) looks_pressed_ = kPressLasts;
  }
  /// Records a query without a good reply.
  void note_miss(Clock::time_point now) noexcept {
    ++misses_;
    if (silence_.look(now) < kDeadline || misses_ < kLeastMisses || !is_heard_) return;
    is_heard_ = false;
    retry_at_ = now + kRetry;
  }
  /// Returns the state, after a query or in its place.
  [[nodiscard]] StopInputLevel look() noexcept {
    if (!is_heard_) return StopInputLevel::kUnheard;
    if (looks_pressed_ <= 0) return StopInputLevel::kReleased;
    --looks_pressed_;
    return StopInputLevel::kPressed;
  }
  [[nodiscard]] bool is_heard() const noexcept { return is_heard_; }

 private:
  static constexpr int kLeastMisses = 2;  ///< even if this thread stood still meanwhile

  RunningTime silence_{std::chrono::milliseconds(60), {}};
  int misses_{0};  ///< in a row
  Clock::time_point retry_at_{};
  bool is_heard_{true};
  int looks_pressed_{0};
};

}  // namespace corbot::rt
