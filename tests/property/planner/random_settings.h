// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/tool_pose.h"
#include "planner/planner.h"

namespace corbot::test {

/// The settings of case `i`: speeds, and what the arm follows of an orientation. `in(low, high)` draws a
/// number.
template <class Draw>
PlanSettings random_settings(const ArmModel& arm, int i, const PlanStart& from, Draw&& in) {
  PlanSettings s;
  if (i % 3 == 0) s.speed_ratio = in(0.05, 1.0);
  if (i % 5 == 0) s.joint_speed_ratio[static_cast<std::size_t>(i / 5) % arm.dof] = in(0.05, 1.0);
  const Pose here = arm.kinematics.forward(from.position_q);
  const Vector3 axis{in(-1, 1), in(-1, 1), in(-1, 1)};
  if (i % 2 == 0 && arm.kinematics.follows() == Follows::kFull)
    s.tool_orientation = about((1.0 / norm(axis)) * axis, in(-0.5, 0.5)) * here.orientation;
  if (arm.kinematics.follows() == Follows::kPitchAndRoll && i % 2 == 0) s.tool_pitch_rad = in(-1.0, 1.0);
  if (arm.kinematics.follows() == Follows::kPitch)
    s.tool_pitch_rad = tool_pose(arm.kinematics, from.position_q).pitch_rad + (i % 2) * in(-0.5, 0.5);
  return s;
}

}  // namespace corbot::test
