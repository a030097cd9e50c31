// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/workspace_check.h"

#include <algorithm>
#include <cstdint>

#include "corbot/channel/alarms.h"

namespace corbot::rt {

void WorkspaceCheck::begin(const ArmModel& arm, const Joints& rest_q) noexcept {
  if (arm.workspace.count == 0) return;
  const JointChain& chain = arm.kinematics.chain();
  points_ = points_of(chain);
  parts_ = parts_of(points_);
  const auto states = part_states(chain, points_, rest_q);
  for (std::size_t k = 0; k < arm.workspace.count; ++k) {
    for (std::size_t part = 0; part < kArmParts; ++part)
      least_m_[k][part] = std::min(0.0, clearance_m(arm.workspace, k, part, parts_[part], states));
  }
}

SetPointVerdict WorkspaceCheck::see(const ArmModel& arm, const Joints& next_q) const noexcept {
  if (arm.workspace.count == 0) return {};
  const auto states = part_states(arm.kinematics.chain(), points_, next_q);
  for (std::size_t k = 0; k < arm.workspace.count; ++k) {
    for (std::size_t part = 0; part < kArmParts; ++part) {
      if (!parts_[part].exists || (arm.workspace.shapes[k].parts & bit_of(part)) == 0) continue;
      const double here_m = clearance_m(arm.workspace, k, part, parts_[part], states);
      if (here_m >= least_m_[k][part] - kTolerance_m) continue;
      return {false, alarm::set_point_outside_workspace({static_cast<std::uint32_t>(k),
                                                         static_cast<std::uint32_t>(part), here_m,
                                                         least_m_[k][part]})};
    }
  }
  return {};
}

}  // namespace corbot::rt
