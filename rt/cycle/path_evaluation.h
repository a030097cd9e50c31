// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/command.h"
#include "rt/cycle/governor.h"

namespace corbot::rt {

/// The set-points of joints and gripper in this cycle.
struct SetPoint {
  Joints position_q{};
  double opening{};
  bool reachable{true};  ///< false: no solution of the inverse kinematics at this point of the path
};

/// Gives the arm the frames of a checked command; a command without a path changes none. Real-time safe.
void take_frames(const Command& command, Kinematics& arm) noexcept;

/// Returns the set-point of a checked command without a path at a virtual time. A joint motion is added to
/// `base`, the set-point of the arm's rest when it began. So a difference within the tolerance of the check
/// is no jump. Real-time safe.
[[nodiscard]] SetPoint evaluate_command(const ArmModel& arm, const Command& command, const SetPoint& base,
                                        double time_s) noexcept;

/// Returns the laws that stop, pause and override must keep within limits while this command runs, which has
/// no path. The limits of the gripper's law are its own peaks. Real-time safe.
[[nodiscard]] GovernedMotion governed_motion(const ArmModel& arm, const Command& command) noexcept;

/// Writes the arm's position, and its speed from the set-point of the previous cycle. Real-time safe.
void publish_set_point(const ArmModel& arm, const SetPoint& now, const SetPoint& before,
                       Snapshot& snapshot) noexcept;

}  // namespace corbot::rt
