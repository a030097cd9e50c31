// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/inputs/cycle_view.h"

namespace corbot::rt {

/// Debounces an emergency stop's input, erring towards pressed. Any edge counts as a press, even if the level
/// is good again. An unreadable input is pressed. It is released only after the input has been good for
/// kGoodAfter_ns. So a bouncing contact counts once, and the cycle, with any period, sees the shortest press.
/// Pure: it is given the time.
class StopLogic {
 public:
  static constexpr std::int64_t kGoodAfter_ns = 50'000'000;

  /// Real-time safe. `is_bad`: active, or an edge was seen, or it cannot be read. Returns whether it is
  /// pressed.
  bool step(bool is_bad, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return is_pressed_; }

 private:
  bool is_pressed_{true};  // until it has been seen to be good
  bool is_known_{false};
  std::int64_t bad_at_ns_{0};
};

/// Decides when the servos have power, by the stop categories of IEC 60204-1. The power goes off when the
/// cycle reports power_off, which is when the arm has slowed down. By this logic's own clock it goes off at
/// the latest `ramp_ns` after a press or the beginning of a fault stop. It does so even if the cycle stands
/// still. In category 0 it goes off at the press. It comes back only after the press is over and the cycle
/// has left Error, which takes a person's Clear. Pure: it is given the time.
class PowerLogic {
 public:
  PowerLogic(int category, std::int64_t ramp_ns) : ramp_ns_(category == 0 ? 0 : ramp_ns) {}

  /// Latches a stop that was seen before the first step.
  void latch() noexcept { is_latched_ = is_off_ = true; }

  /// Real-time safe. `stop_seen` and `presses`: from EmergencyStop, both read before `view` is taken. Returns
  /// whether stops allow power.
  bool step(std::int64_t now_ns, bool stop_seen, std::uint32_t presses, const CycleView& view) noexcept;

 private:
  std::int64_t ramp_ns_;
  bool is_latched_{false};  ///< a stop was seen, and has not been cleared
  bool is_off_{false};      ///< latched, and the power is off
  std::uint32_t presses_seen_{0};
  std::uint64_t latched_in_cycle_{0};  ///< the newest cycle when a cause was last present
  std::int64_t begun_ns_{0};
};

}  // namespace corbot::rt
