// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/arm_parts.h"

namespace corbot::test {

inline constexpr std::uint32_t kPoints = bit_of(0) | bit_of(1) | bit_of(2);
inline constexpr std::uint32_t kPointsAndLinks = (1u << kArmParts) - 1;

/// Returns the arm with a floor and four posts around it, at this share of its reach at zero joints. All hold
/// for `parts`.
inline ArmModel among_posts(ArmModel arm, double share, std::uint32_t parts) {
  const double reach_m = norm(arm.kinematics.forward({}).position_m);
  const double half_m = 0.05 * reach_m;
  arm.workspace.count = 5;
  arm.workspace.link_radius_m.fill(half_m);
  arm.workspace.shapes[0] = plane_shape({{0.0, 0.0, 1.0}, -share * reach_m}, parts);
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector3 foot_m{(k % 2 == 0 ? share : -share) * reach_m, (k < 2 ? share : -share) * reach_m, 0.0};
    const Vector3 half{half_m, half_m, reach_m};
    arm.workspace.shapes[k + 1] = box_shape(ShapeKind::kOutside, foot_m - half, foot_m + half, parts);
  }
  return arm;
}

}  // namespace corbot::test
