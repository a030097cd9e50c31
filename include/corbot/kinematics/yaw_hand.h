// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "corbot/kinematics/closed_form.h"

namespace corbot {

/// What a hand that only turns about z takes of an orientation.
struct YawHand {
  double yaw_rad{};
  double error_rad{};  ///< the tilt, which it cannot take
  Vector3 axis_m{};    ///< where the last frame's origin must be for the tool to be at its position
};

/// The nearest rotation about z (twist) to p's, and the tilt that remains (swing); `p` in the family's frame. Upside down every yaw is
/// half a turn off: then it is the hint's.
[[nodiscard]] inline YawHand yaw_hand(const Mounting& mount, const Pose& p, double yaw_hint_rad) noexcept {
  const Quaternion g = p.orientation * mount.unhand;
  const double upright = root_sum(g.w, g.z);
  YawHand hand;
  hand.yaw_rad = upright <= 1e-9 ? yaw_hint_rad : 2.0 * std::atan2(g.z, g.w);
  hand.error_rad = double_angle(root_sum(g.x, g.y), upright);
  const Vector3& tool = mount.hand.position_m;
  const double c = std::cos(hand.yaw_rad), s = std::sin(hand.yaw_rad);
  hand.axis_m = p.position_m - Vector3{c * tool[0] - s * tool[1], s * tool[0] + c * tool[1], tool[2]};
  return hand;
}

}  // namespace corbot
