// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// Turns what an emergency stop's input shows into pressed or not, in favour of pressed: an edge is a press
/// though the level be good again, an input that cannot be read is pressed, and only after it has been good
/// for a while is it released, so that a contact that bounces counts once and the cycle, whatever its period,
/// sees the shortest press. Pure: it is given the time.
class StopLogic {
 public:
  static constexpr std::int64_t kGoodAfter_ns = 50'000'000;

  /// Real-time safe. `is_bad`: active, or an edge was seen, or it cannot be read. Whether it is pressed.
  bool step(bool is_bad, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return is_pressed_; }

 private:
  bool is_pressed_{true};  // until it has been seen to be good
  bool is_known_{false};
  std::int64_t bad_at_ns_{0};
};

/// Whether the servos may have power: after the device was opened, and, once a stop was seen, not before the
/// operator has cleared it. Releasing a stop must not set anything in motion. Pure.
class PowerLogic {
 public:
  explicit PowerLogic(bool off_at_stop) : off_at_stop_(off_at_stop) {}

  /// A stop that was seen before the first step.
  void latch() noexcept { is_latched_ = true; }

  /// Real-time safe. `stop_seen` and `presses`: of EmergencyStop; `cycle` and `in_error`: what the real-time
  /// cycle has published last.
  bool step(bool is_open, bool stop_seen, std::uint32_t presses, std::uint64_t cycle, bool in_error) noexcept;

 private:
  bool off_at_stop_;
  bool is_latched_{false};
  std::uint32_t presses_seen_{0};
  std::uint64_t latched_in_cycle_{0};
};

}  // namespace corbot::rt
