// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "corbot/kinematics/kinematics.h"
#include "corbot/motion/command.h"
#include "rt/rig.h"

namespace corbot::test {

/// From here, a line over the arm's base leaves what the joints can do in its middle.
inline constexpr Joints kBesideTheBase{1.5, 0.9, 1.2, 0.6};

/// A line over the arm's base, which no planner would give out: it begins and ends well, so the check of commands lets it pass.
inline Command line_over_the_base(const Rig& rig) {
  const Joints from_rad = rig.snapshot.position_rad;
  Joints to_rad = from_rad;
  to_rad[0] = -from_rad[0];
  const ToolPose from = forward(rig.arm.geometry, from_rad);
  const ToolPose to = forward(rig.arm.geometry, to_rad);
  Command command{};
  command.kind = MotionKind::kLine;
  command.start_rad = from_rad;
  command.end_rad = to_rad;
  command.line.from_m = from.position_m;
  command.line.to_m = to.position_m;
  command.line.from_pitch_rad = from.pitch_rad;
  command.line.to_pitch_rad = to.pitch_rad;
  for (std::uint32_t branch = 0; branch < kBranchCount; ++branch) {
    command.line.branch = static_cast<Branch>(branch);
    const IkResult ik =
        inverse(rig.arm.geometry, from.position_m, from.pitch_rad, command.line.branch, from_rad[0]);
    if (ik.status != IkStatus::kOk) continue;
    double miss_rad = 0.0;
    for (std::size_t i = 0; i < kMaxJoints; ++i)
      miss_rad = std::max(miss_rad, std::abs(ik.position_rad[i] - from_rad[i]));
    if (miss_rad < 1e-6) break;
  }
  command.line.law = {1.0, 0.3, 0.3, 1.6};
  command.duration_s = command.line.law.duration_s();
  return command;
}

}  // namespace corbot::test
