// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/channel/alarms.h"
#include "corbot/channel/layout.h"
#include "rt/cycle/connected_servant.h"

namespace corbot::rt {

/// The task's end of the ring of alarms, and a copy of each alarm for this process to print. Real-time safe.
class AlarmOutput {
 public:
  explicit AlarmOutput(TaskSegment& task) noexcept
      : alarms_(task.alarms, kNoServant.alarms_tail), log_(copies_) {}
  /// Switches to another servant, which reads the alarms from now on.
  void follow(const RingTail<>& tail) noexcept { alarms_.follow(tail); }

  void raise(AlarmEvent alarm, std::int64_t wall_ns) noexcept {
    alarm.time_ns = wall_ns;
    // A full ring drops the alarm: the 64 before it have not been read either, and the state shows a fault.
    (void)alarms_.push(alarm);
    (void)log_.push(alarm);
  }
  /// Records that the Clear of this number ended Error.
  void clear(std::uint64_t clears) noexcept { cleared_ = clears; }
  /// Reports the Clear before any alarm of the cycle, so that its place in the ring is right. A full ring
  /// drops alarms, and the report is tried again. Returns whether it was reported.
  bool report_clear(std::int64_t wall_ns) noexcept {
    if (cleared_ == 0) return false;
    AlarmEvent event = alarm::cleared(cleared_);
    event.time_ns = wall_ns;
    if (!alarms_.push(event)) return false;
    cleared_ = 0;
    return true;
  }
  /// Returns the copies; one other thread consumes them.
  [[nodiscard]] Ring<AlarmEvent, 64>& copies() noexcept { return copies_; }

 private:
  RingProducer<decltype(TaskSegment::alarms)> alarms_;
  Ring<AlarmEvent, 64> copies_;
  RingProducer<Ring<AlarmEvent, 64>::Slots> log_;
  std::uint64_t cleared_{0};  ///< not reported yet; 0: none
};

}  // namespace corbot::rt
