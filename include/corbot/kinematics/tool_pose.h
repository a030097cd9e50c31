// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <variant>

#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/planar_arm.h"

// The tool's heading and pitch. People and the paths of four-axis arms describe an orientation by these.
// Real-time safe.

namespace corbot {

/// Position of the tool centre point and orientation of the tool frame in the base frame: Rz(yaw) Ry(−pitch)
/// Rx(roll). An arm *turns in its plane* if it is upright and follows the tool pitch alone, and if the tool's
/// x axis is in its plane.
struct ToolPose {
  Vector3 position_m{};
  double yaw_rad{};    ///< if the arm turns in its plane: this plane's heading, as the first joint counts it
  double pitch_rad{};  ///< of the x axis, positive upward; beyond ±90 degrees if an arm that turns in its
                       ///< plane has the tool upside down
  double roll_rad{};   ///< constant if the arm turns in its plane; 0 with the paper's tool frame
};

namespace detail {

/// Returns the arm's family if it has a tool pitch, else null.
[[nodiscard]] inline const PlanarArm* pitching(const Kinematics& arm) noexcept {
  const auto* planar = std::get_if<PlanarArm>(&arm.form());
  return planar != nullptr && planar->follows() == Follows::kPitch ? planar : nullptr;
}

/// Returns −1 if the family's z axis points down (a table with its base turned over, an arm that hangs). Its
/// inclinations then count downward.
[[nodiscard]] inline double sign_of_pitch(const PlanarArm& planar) noexcept {
  return rotate(planar.mount.base.orientation, {0.0, 0.0, 1.0})[2] < 0.0 ? -1.0 : 1.0;
}

/// Returns the tool frame's roll about its own x axis if this axis is in the arm's plane, else nothing.
[[nodiscard]] inline std::optional<double> roll_in_plane(const Mounting& mount) noexcept {
  const Quaternion rest = about({0.0, 1.0, 0.0}, mount.tool_tilt_rad) * mount.hand.orientation;
  if (std::abs(rest.y) + std::abs(rest.z) > kNoDirection) return std::nullopt;
  if (std::abs(rest.x) < 1e-12) return 0.0;  // turned by rounding
  return 2.0 * std::atan2(rest.w < 0.0 ? -rest.x : rest.x, std::abs(rest.w));
}

}  // namespace detail

/// Tells whether the arm has a tool pitch: the first angle that it follows is one.
[[nodiscard]] inline bool has_tool_pitch(const Kinematics& arm) noexcept {
  return arm.follows() == Follows::kPitch || arm.follows() == Follows::kPitchAndRoll;
}

/// Returns the followed angle at which an arm with a tool pitch has this pitch: that of the tool's x axis, or
/// of its projection onto the arm's plane.
[[nodiscard]] inline double angle_of_pitch(const Kinematics& arm, double pitch_rad) noexcept {
  const auto* planar = std::get_if<PlanarArm>(&arm.form());
  if (planar == nullptr) return pitch_rad;
  return detail::sign_of_pitch(*planar) * pitch_rad - planar->mount.tool_tilt_rad;
}

/// Returns the pitch at a followed angle.
[[nodiscard]] inline double pitch_of_angle(const Kinematics& arm, double angle_rad) noexcept {
  const auto* planar = std::get_if<PlanarArm>(&arm.form());
  if (planar == nullptr) return angle_rad;
  return detail::sign_of_pitch(*planar) * (angle_rad + planar->mount.tool_tilt_rad);
}

/// Returns the tool's pose. If the arm turns in its plane, yaw and pitch are sums of its joints, not wrapped.
/// Otherwise the pitch is within ±90 degrees, and at ±90 the roll is 0.
[[nodiscard]] inline ToolPose tool_pose(const Kinematics& arm, const Joints& q) noexcept {
  const Pose pose = arm.forward(q);
  if (const PlanarArm* planar = detail::pitching(arm); planar != nullptr && planar->mount.upright) {
    const PlanarLinks& links = planar->links;
    if (const std::optional<double> roll_rad = detail::roll_in_plane(planar->mount)) {
      return {pose.position_m, planar->mount.heading_rad + q[0],
              planar->mount.tool_tilt_rad + links.sign2 * q[1] + links.sign3 * q[2] + links.sign4 * q[3],
              *roll_rad};
    }
  }
  const Matrix3 r = to_matrix(pose.orientation);
  if (root_sum(r[2][1], r[2][2]) < kNoDirection)
    return {pose.position_m, std::atan2(-r[0][1], r[1][1]), std::atan2(r[2][0], 0.0)};
  return {pose.position_m, std::atan2(r[1][0], r[0][0]), std::atan2(r[2][0], root_sum(r[2][1], r[2][2])),
          std::atan2(r[2][1], r[2][2])};
}

}  // namespace corbot
