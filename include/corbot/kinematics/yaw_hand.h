// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "corbot/kinematics/closed_form.h"

namespace corbot {

/// The part of an orientation that a hand takes if it turns only about z.
struct YawHand {
  double yaw_rad{};
  double error_rad{};  ///< the tilt, which it cannot take
};

/// Returns the nearest rotation about z (twist) to the orientation in the family's frame, and the remaining
/// tilt (swing). Upside down every yaw is half a turn off. Then the hint's yaw counts.
[[nodiscard]] inline YawHand yaw_hand(const Mounting& mount, const Quaternion& orientation,
                                      double yaw_hint_rad) noexcept {
  const Quaternion g = orientation * mount.unhand;
  const double upright = root_sum(g.w, g.z);
  return {upright <= 1e-9 ? yaw_hint_rad : 2.0 * std::atan2(g.z, g.w),
          double_angle(root_sum(g.x, g.y), upright)};
}

/// Returns the place of the last frame's origin that brings the tool to this position with this yaw.
[[nodiscard]] inline Vector3 hand_axis(const Mounting& mount, const Vector3& position_m,
                                       double yaw_rad) noexcept {
  const Vector3& tool = mount.hand.position_m;
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return position_m - Vector3{c * tool[0] - s * tool[1], s * tool[0] + c * tool[1], tool[2]};
}

}  // namespace corbot
