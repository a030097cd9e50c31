// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/channel/alarms.h"
#include "corbot/channel/layout.h"
#include "rt/cycle/connected_servant.h"

namespace corbot::rt {

/// The task's end of the ring of alarms, and a copy of each for this process to print. Real-time safe.
class AlarmOutput {
 public:
  explicit AlarmOutput(TaskSegment& task) noexcept
      : alarms_(task.alarms, kNoServant.alarms_tail), log_(copies_) {}
  /// Another servant reads them from now on.
  void follow(const RingTail<>& tail) noexcept { alarms_.follow(tail); }

  void raise(AlarmEvent alarm, std::int64_t wall_ns) noexcept {
    alarm.time_ns = wall_ns;
    // A full ring drops the alarm: the 64 before it have not been read either, and the state shows a fault.
    (void)alarms_.push(alarm);
    (void)log_.push(alarm);
  }
  /// The Error was left by the Clear of this number.
  void clear(std::uint64_t clears) noexcept { cleared_ = clears; }
  /// Reports that, before any alarm of the cycle, so that its place in the ring is right. A full ring drops
  /// alarms, and this is tried again. True where something was reported.
  bool report_clear(std::int64_t wall_ns) noexcept {
    if (cleared_ == 0) return false;
    AlarmEvent event = alarm::cleared(cleared_);
    event.time_ns = wall_ns;
    if (!alarms_.push(event)) return false;
    cleared_ = 0;
    return true;
  }
  /// Consumed by one other thread.
  [[nodiscard]] Ring<AlarmEvent, 64>& copies() noexcept { return copies_; }

 private:
  RingProducer<decltype(TaskSegment::alarms)> alarms_;
  Ring<AlarmEvent, 64> copies_;
  RingProducer<Ring<AlarmEvent, 64>::Slots> log_;
  std::uint64_t cleared_{0};  ///< not reported yet; 0: none
};

}  // namespace corbot::rt
