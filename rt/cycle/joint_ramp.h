// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "rt/cycle/stop_law.h"

namespace corbot::rt {

/// Brings every joint to rest by itself: for a fault that leaves no path to slow down on. From the last set-points that
/// were good, with their difference quotients for velocity and acceleration, so that the differences of the set-points
/// keep every joint's limits of acceleration and jerk, from the first of them on. A joint that would leave its range
/// brakes harder than its limits allow. Real-time safe: computed once, at the fault, by a bounded search; a cycle costs
/// one evaluation a joint.
class JointRamp {
 public:
  explicit JointRamp(const ArmModel& arm) noexcept;

  /// Once a cycle: a set-point that is given to the servos.
  void see(const Joints& position_q) noexcept;
  /// The arm is at rest here, however it came here.
  void rest_at(const Joints& position_q) noexcept;

  /// From the last set-point seen.
  void begin() noexcept;
  /// The set-point of the next cycle; to be seen like all others.
  [[nodiscard]] Joints next() noexcept;
  /// The last set-point of next() is where the arm rests.
  [[nodiscard]] bool at_rest() const noexcept { return elapsed_s_ >= duration_s_; }

 private:
  [[nodiscard]] StopLaw law_within_range(std::size_t joint) const noexcept;

  std::size_t dof_;
  std::array<JointLimits, kMaxJoints> limits_;
  double period_s_;
  Joints position_q_{};
  Joints velocity_q_s_{};
  Joints acceleration_q_s2_{};
  std::array<StopLaw, kMaxJoints> laws_{};
  double elapsed_s_{0.0};
  double duration_s_{0.0};
};

}  // namespace corbot::rt
