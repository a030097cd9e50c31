// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/stop_logic.h"

namespace corbot::rt {

bool StopLogic::step(bool is_bad, std::int64_t now_ns) noexcept {
  if (is_bad) {
    is_pressed_ = true;
    bad_at_ns_ = now_ns;
  } else if (!is_known_ || now_ns - bad_at_ns_ >= kGoodAfter_ns) {
    is_pressed_ = false;
  }
  is_known_ = true;
  return is_pressed_;
}

bool PowerLogic::step(std::int64_t now_ns, bool stop_seen, std::uint32_t presses,
                      const CycleView& view) noexcept {
  // The cycle that published this view, and the next one, may have begun before the press. The one after them
  // began after this view was taken, and so after the press was counted.
  constexpr std::uint64_t kCyclesToSee = 2;
  constexpr std::uint64_t kUnknown = ~std::uint64_t{0};
  if (stop_seen || presses != presses_seen_ || view.power_off || view.fault_stop) {
    presses_seen_ = presses;
    if (!is_latched_) begun_ns_ = now_ns;
    is_latched_ = true;
    latched_in_cycle_ = view.is_known ? view.cycle : kUnknown;
  } else if (view.is_known && latched_in_cycle_ == kUnknown) {
    latched_in_cycle_ = view.cycle;
  } else if (view.is_known && !view.in_error && view.cycle >= latched_in_cycle_ + kCyclesToSee) {
    is_latched_ = is_off_ = false;
  }
  is_off_ = is_off_ || (is_latched_ && (view.power_off || now_ns - begun_ns_ >= ramp_ns_));
  return !is_off_;
}

}  // namespace corbot::rt
