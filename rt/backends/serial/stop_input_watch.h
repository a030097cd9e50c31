// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "corbot/running_time.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// The state of an emergency stop input that is asked for over a line, and how long it may go without a good
/// reply. Pure: it is given the time.
class StopInputWatch {
 public:
  using Clock = RunningTime::Clock;
  /// Of time that this process ran; on a line with frames further apart than that, two of them.
  static constexpr std::chrono::milliseconds kDeadline{100};
  /// While it is not heard it is asked for only so often: frames, which bring the arm to rest, do not wait
  /// for it, and a reply that is as late as that is no reply to an earlier query.
  static constexpr std::chrono::milliseconds kRetry{500};
  /// A short press is reported for this many looks, longer than any period of the cycle.
  static constexpr int kPressLasts = 5;

  /// Heard just now, not pressed.
  void begin(Clock::time_point now) noexcept {
    silence_.restart(now);
    misses_ = 0;
    is_heard_ = true;
    looks_pressed_ = 0;
  }
  /// Whether to ask now. A query must follow.
  [[nodiscard]] bool is_due(Clock::time_point now) noexcept {
    if (is_heard_) return true;
    if (now < retry_at_) return false;
    retry_at_ = now + kRetry;
    return true;
  }
  /// A good reply.
  void note(bool is_pressed, Clock::time_point now) noexcept {
    silence_.restart(now);
    misses_ = 0;
    is_heard_ = true;
    if (is_pressed) looks_pressed_ = kPressLasts;
  }
  /// A query without a good reply.
  void note_miss(Clock::time_point now) noexcept {
    ++misses_;
    if (silence_.look(now) < kDeadline || misses_ < kLeastMisses || !is_heard_) return;
    is_heard_ = false;
    retry_at_ = now + kRetry;
  }
  /// After a query, or in its place.
  [[nodiscard]] StopInputLevel look() noexcept {
    if (!is_heard_) return StopInputLevel::kUnheard;
    return looks_pressed_ > 0 && looks_pressed_-- > 0 ? StopInputLevel::kPressed : StopInputLevel::kReleased;
  }
  [[nodiscard]] bool is_heard() const noexcept { return is_heard_; }

 private:
  static constexpr int kLeastMisses = 2;  ///< however long this thread stood still meanwhile

  RunningTime silence_{std::chrono::milliseconds(60), {}};
  int misses_{0};  ///< in a row
  Clock::time_point retry_at_{};
  bool is_heard_{true};
  int looks_pressed_{0};
};

}  // namespace corbot::rt
