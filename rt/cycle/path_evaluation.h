// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/command.h"
#include "rt/cycle/governor.h"

namespace corbot::rt {

/// Where joints and gripper shall be in this cycle.
struct SetPoint {
  Joints position_q{};
  double opening{};
  bool reachable{true};  ///< false: no solution of the inverse kinematics at this point of the path
};

/// Gives the arm the frames of a checked command; those of one without a path are left. Real-time safe.
void take_frames(const Command& command, Kinematics& arm) noexcept;

/// The set-point of a checked command without a path at a virtual time. A joint motion is laid upon `base`, the set-point at
/// which the arm rested when it began, so that a difference within the tolerance of the check is no jump.
/// Real-time safe.
[[nodiscard]] SetPoint evaluate_command(const ArmModel& arm, const Command& command, const SetPoint& base,
                                        double time_s) noexcept;

/// The laws that stop, pause and override must keep within limits while this command runs, which has no path. The limits of the
/// gripper's law are its own peaks. Real-time safe.
[[nodiscard]] GovernedMotion governed_motion(const ArmModel& arm, const Command& command) noexcept;

/// Fills in where the arm is and how fast it got there from the set-point of the cycle before. Real-time safe.
void publish_set_point(const ArmModel& arm, const SetPoint& now, const SetPoint& before,
                       Snapshot& snapshot) noexcept;

}  // namespace corbot::rt
