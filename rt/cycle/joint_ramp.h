// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "rt/cycle/stop_law.h"

namespace corbot::rt {

/// Brings every joint to rest by itself, for a fault that leaves no path to slow down on. It starts from the
/// last good set-points, with their difference quotients as velocity and acceleration. So the differences of
/// the set-points keep every joint's limits of acceleration and jerk, from the first of them on. A joint that
/// would leave its range brakes harder than its limits allow. Real-time safe: computed once, at the fault, by
/// a bounded search. A cycle costs one evaluation for each joint.
class JointRamp {
 public:
  explicit JointRamp(const ArmModel& arm) noexcept;

  /// Called once a cycle with a set-point that is given to the servos.
  void see(const Joints& position_q) noexcept;
  /// Records that the arm is at rest here, for any reason.
  void rest_at(const Joints& position_q) noexcept;

  /// Begins at the last set-point seen.
  void begin() noexcept;
  /// Returns the set-point of the next cycle; see() must get it like all others.
  [[nodiscard]] Joints next() noexcept;
  /// The arm rests at the last set-point of next().
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
