// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/command.h"
#include "rt/rig.h"

namespace corbot::test {

/// From here, a line over the arm's base leaves what the joints can do in its middle.
inline constexpr Joints kBesideTheBase{1.5, 0.9, 1.2, 0.6};

/// A line over the arm's base, which no planner would give out: it begins and ends well, so the check of commands lets it pass.
inline Command line_over_the_base(const Rig& rig) {
  const Joints from_q = rig.snapshot.position_q;
  Joints to_q = from_q;
  to_q[0] = -from_q[0];
  const ToolPose from = tool_pose(rig.arm.kinematics, from_q);
  const ToolPose to = tool_pose(rig.arm.kinematics, to_q);
  Command command{};
  command.kind = MotionKind::kLine;
  command.start_q = from_q;
  command.end_q = to_q;
  command.line = {};
  command.line.frames = frames_of(rig.arm.kinematics);
  command.line.from_m = from.position_m;
  command.line.to_m = to.position_m;
  command.line.tool.from_angles_rad = rig.arm.kinematics.followed().at(from_q);
  command.line.tool.to_angles_rad = rig.arm.kinematics.followed().at(to_q);
  command.line.solution = rig.arm.kinematics.solution_of(from_q).value_or(0);
  command.line.law = {1.0, 0.3, 0.3, 1.6};
  command.duration_s = command.line.law.duration_s();
  return command;
}

}  // namespace corbot::test
