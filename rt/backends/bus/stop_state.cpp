// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/stop_state.h"

namespace corbot::rt {

void StopState::look(const ServoFrame& newest, Time now) noexcept {
  if (is_awaiting_) {
    if (!asked_in_) asked_in_ = newest.cycle;
    is_awaiting_ = newest.cycle < *asked_in_ + (newest.needs_clear ? kAnswerFrames : kClearedFrames);
  }
  const auto [sources, presses] = stop_.state();
  const bool is_pressed = sources != 0;
  if (presses != presses_seen_) {
    presses_seen_ = presses;
    if (!pressed_at_) pressed_at_ = now;
    await_answer();
  }
  if (!is_awaiting_ && !is_pressed && !newest.needs_clear) pressed_at_.reset();
  is_stopped_ = is_awaiting_ || is_pressed || newest.needs_clear;
  is_power_off_due_ =
      (newest.needs_clear && newest.power_off) || (pressed_at_ && now - *pressed_at_ >= ramp_);
}

}  // namespace corbot::rt
