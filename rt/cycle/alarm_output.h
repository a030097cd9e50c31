// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/channel/alarms.h"
#include "corbot/channel/layout.h"

namespace corbot::rt {

/// The task's end of the ring of alarms, and a copy of each for this process to print. Real-time safe.
class AlarmOutput {
 public:
  explicit AlarmOutput(SegmentLayout& segment) noexcept : alarms_(segment.alarms), log_(copies_) {}

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
  RingProducer<decltype(SegmentLayout::alarms)> alarms_;
  Ring<AlarmEvent, 64> copies_;
  RingProducer<Ring<AlarmEvent, 64>> log_;
  std::uint64_t cleared_{0};  ///< not reported yet; 0: none
};

}  // namespace corbot::rt
