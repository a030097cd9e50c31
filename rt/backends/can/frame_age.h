// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

#include "corbot/backend/backend.h"
#include "corbot/running_time.h"

namespace corbot::rt {

/// Tells whether the cycle's frames go on. Before the first frame that differs from its predecessor the cycle
/// does not run yet, and nothing is stale. A standstill of this thread does not count.
class FrameAge {
 public:
  using Clock = RunningTime::Clock;

  /// `limit` 0: frames never count as stale.
  explicit FrameAge(Clock::duration limit) : limit_(limit), age_(limit / kLooks, Clock::time_point{}) {}

  /// Looks at the newest frame.
  void see(const ServoFrame& frame, Clock::time_point now) {
    const bool is_new = frame.cycle != cycle_ || frame.time_ns != time_ns_;
    runs_ = has_seen_ && (runs_ || is_new);
    has_seen_ = true;
    cycle_ = frame.cycle;
    time_ns_ = frame.time_ns;
    if (is_new || !runs_) {
      age_.restart(now);
    } else {
      (void)age_.look(now);
    }
  }
  [[nodiscard]] bool is_stale() const { return runs_ && limit_.count() > 0 && age_.passed() > limit_; }
  [[nodiscard]] Clock::duration limit() const { return limit_; }

 private:
  /// At least this many looks found nothing new: one look after a standstill proves nothing.
  static constexpr int kLooks = 4;

  Clock::duration limit_;
  RunningTime age_;
  std::uint64_t cycle_{};
  std::int64_t time_ns_{};
  bool has_seen_{false};
  bool runs_{false};
};

}  // namespace corbot::rt
