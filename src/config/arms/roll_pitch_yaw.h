// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "corbot/kinematics/dh_table.h"
#include "corbot/kinematics/pose.h"

namespace corbot::config {

/// Roll about x, then pitch about y, then yaw about z, all about fixed axes, like in a URDF: Rz(yaw)
/// Ry(pitch) Rx(roll). Radians.
struct RollPitchYaw {
  double roll_rad{};
  double pitch_rad{};
  double yaw_rad{};
};

/// Converts to a quaternion. Right and straight angles are exact.
[[nodiscard]] inline Quaternion to_quaternion(const RollPitchYaw& angles) noexcept {
  const auto turn = [](std::size_t axis, double angle_rad) {
    const double c = detail::exact_cosine(0.5 * angle_rad), s = detail::exact_sine(0.5 * angle_rad);
    return Quaternion{c, axis == 0 ? s : 0.0, axis == 1 ? s : 0.0, axis == 2 ? s : 0.0};
  };
  return normalised(turn(2, angles.yaw_rad) * turn(1, angles.pitch_rad) * turn(0, angles.roll_rad));
}

/// Converts to angles. The yaw follows from the horizontal part of x, the roll from the rotation that yaw and
/// pitch leave. The three together therefore lose no digits near a pitch of 90 degrees, although yaw and roll
/// alone do. At 90 degrees the yaw is 0.
[[nodiscard]] inline RollPitchYaw to_roll_pitch_yaw(const Quaternion& orientation) noexcept {
  constexpr double kUpright = 1e-13;
  const Matrix3 r = to_matrix(orientation);
  const double level = std::hypot(r[0][0], r[1][0]);
  RollPitchYaw angles;
  angles.pitch_rad = std::atan2(-r[2][0], level);
  angles.yaw_rad = level < kUpright ? 0.0 : std::atan2(r[1][0], r[0][0]);
  const Quaternion before = to_quaternion({0.0, angles.pitch_rad, angles.yaw_rad});
  const Quaternion rest = conjugate(before) * orientation;
  angles.roll_rad = 2.0 * std::atan2(rest.w < 0.0 ? -rest.x : rest.x, std::abs(rest.w));
  return angles;
}

}  // namespace corbot::config
