// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

// An arm as its joint axes and the pose of its last frame, all at zero (product of exponentials; Brockett
// 1984). Every D-H table and every URDF has this form. Families are recognised from it, and it provides the
// one Jacobian of all arms. Real-time safe.

namespace corbot {

/// The axis of one joint when all joints are zero, in frame 0.
struct JointAxis {
  JointKind kind{JointKind::kRotary};
  /// A unit vector. A positive value turns right-handed about it, or slides along it.
  Vector3 direction{0.0, 0.0, 1.0};
  Vector3 point_m{};  ///< any point on the axis; without a meaning for a slide
};

struct JointChain {
  std::uint32_t count{};  ///< joints, 1 … kMaxJoints
  std::array<JointAxis, kMaxJoints> axes{};
  Pose zero_T_n{};  ///< last frame (flange) in frame 0 at zero
  Pose base_T_0{};  ///< the arm's place in the base frame
  Pose n_T_tool{};  ///< from the flange to the tool centre point
};
static_assert(std::is_trivially_copyable_v<JointChain>);

/// Returns the motion of everything beyond an axis when its joint has this value, in frame 0.
[[nodiscard]] inline Pose displacement(const JointAxis& axis, double value_q) noexcept {
  if (axis.kind == JointKind::kPrismatic) return {value_q * axis.direction, {}};
  const Quaternion q = about(axis.direction, value_q);
  return {axis.point_m - rotate(q, axis.point_m), q};
}

/// Returns base_T_tool.
[[nodiscard]] inline Pose forward(const JointChain& chain, const Joints& q) noexcept {
  Pose pose = chain.base_T_0;
  for (std::size_t i = 0; i < chain.count; ++i) pose = pose * displacement(chain.axes[i], q[i]);
  return pose * chain.zero_T_n * chain.n_T_tool;
}

/// Columns: joints. Rows 0 … 2: velocity of the tool centre point (m/s); rows 3 … 5: angular velocity of the
/// tool (rad/s). Both are in the base frame, for a joint speed of 1 (rad/s or m/s). Columns beyond the arm's
/// joints are zero.
using Jacobian = std::array<std::array<double, kMaxJoints>, 6>;

[[nodiscard]] inline Jacobian jacobian(const JointChain& chain, const Joints& q) noexcept {
  std::array<Vector3, kMaxJoints> direction{}, point{};
  Pose pose = chain.base_T_0;
  for (std::size_t i = 0; i < chain.count; ++i) {
    direction[i] = rotate(pose.orientation, chain.axes[i].direction);
    point[i] = pose.position_m + rotate(pose.orientation, chain.axes[i].point_m);
    pose = pose * displacement(chain.axes[i], q[i]);
  }
  const Vector3 tool_m = (pose * chain.zero_T_n * chain.n_T_tool).position_m;
  Jacobian j{};
  for (std::size_t i = 0; i < chain.count; ++i) {
    const bool turns = chain.axes[i].kind == JointKind::kRotary;
    const Vector3 linear = turns ? cross(direction[i], tool_m - point[i]) : direction[i];
    for (std::size_t k = 0; k < 3; ++k) {
      j[k][i] = linear[k];
      j[k + 3][i] = turns ? direction[i][k] : 0.0;
    }
  }
  return j;
}

}  // namespace corbot
