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
  const Joints from_q = rig.snapshot.position_q;
  Joints to_q = from_q;
  to_q[0] = -from_q[0];
  const ToolPose from = forward(rig.arm.geometry, from_q);
  const ToolPose to = forward(rig.arm.geometry, to_q);
  Command command{};
  command.kind = MotionKind::kLine;
  command.start_q = from_q;
  command.end_q = to_q;
  command.line.from_m = from.position_m;
  command.line.to_m = to.position_m;
  command.line.from_pitch_rad = from.pitch_rad;
  command.line.to_pitch_rad = to.pitch_rad;
  for (std::uint32_t branch = 0; branch < kBranchCount; ++branch) {
    command.line.branch = static_cast<Branch>(branch);
    const IkResult ik =
        inverse(rig.arm.geometry, from.position_m, from.pitch_rad, command.line.branch, from_q[0]);
    if (ik.status != IkStatus::kOk) continue;
    double miss_q = 0.0;
    for (std::size_t i = 0; i < kMaxJoints; ++i)
      miss_q = std::max(miss_q, std::abs(ik.position_q[i] - from_q[i]));
    if (miss_q < 1e-6) break;
  }
  command.line.law = {1.0, 0.3, 0.3, 1.6};
  command.duration_s = command.line.law.duration_s();
  return command;
}

}  // namespace corbot::test
