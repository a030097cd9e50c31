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

bool PowerLogic::step(bool is_open, bool stop_seen, std::uint32_t presses, std::uint64_t cycle,
                      bool in_error) noexcept {
  // The cycle may have published its state before it saw the stop; two cycles later it has not.
  constexpr std::uint64_t kCyclesToSee = 2;
  if (stop_seen || presses != presses_seen_) {
    presses_seen_ = presses;
    is_latched_ = true;
    latched_in_cycle_ = cycle;
  } else if (is_latched_ && !in_error && cycle >= latched_in_cycle_ + kCyclesToSee) {
    is_latched_ = false;
  }
  return is_open && !(off_at_stop_ && is_latched_);
}

}  // namespace corbot::rt
