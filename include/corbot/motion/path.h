// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "corbot/motion/command.h"

// The point of a path at parameter s in [0, 1]. Real-time safe.

namespace corbot {

/// TCP in the base frame, and the tool's orientation or the angles that the arm follows instead.
struct PathPoint {
  std::array<double, 3> position_m{};
  Quaternion orientation{};
  Angles angles_rad{};
};

namespace detail {

/// Interpolates; exact at s = 0, at s = 1 and if both ends are equal.
[[nodiscard]] inline double blend(double from, double to, double s) noexcept {
  return from == to ? from : from * (1.0 - s) + to * s;
}

}  // namespace detail

[[nodiscard]] inline Quaternion orientation_at(const OrientationPath& tool, double s) noexcept {
  const double angle_rad = norm(tool.turn_rad);
  return angle_rad > 0.0 ? about((1.0 / angle_rad) * tool.turn_rad, s * angle_rad) * tool.from : tool.from;
}

[[nodiscard]] inline Angles angles_at(const OrientationPath& tool, double s) noexcept {
  return {detail::blend(tool.from_angles_rad[0], tool.to_angles_rad[0], s),
          detail::blend(tool.from_angles_rad[1], tool.to_angles_rad[1], s)};
}

/// Returns the tool's angular velocity per unit of s, or the rates of the angles that the arm follows. A path
/// has only one of the two.
[[nodiscard]] inline Vector3 turn_of(const OrientationPath& tool) noexcept {
  return tool.turn_rad + Vector3{tool.to_angles_rad[0] - tool.from_angles_rad[0],
                                 tool.to_angles_rad[1] - tool.from_angles_rad[1], 0.0};
}

/// Returns the angle by which the tool turns over the whole path. Pitch and roll turn about axes that are
/// square to each other.
[[nodiscard]] inline double rotation_rad(const OrientationPath& tool) noexcept {
  return norm(tool.turn_rad) + root_sum(tool.to_angles_rad[0] - tool.from_angles_rad[0],
                                        tool.to_angles_rad[1] - tool.from_angles_rad[1]);
}

[[nodiscard]] inline PathPoint point_at(const LineMotion& line, double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  return {{detail::blend(line.from_m[0], line.to_m[0], s), detail::blend(line.from_m[1], line.to_m[1], s),
           detail::blend(line.from_m[2], line.to_m[2], s)},
          orientation_at(line.tool, s),
          angles_at(line.tool, s)};
}

[[nodiscard]] inline PathPoint point_at(const ArcMotion& arc, double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  const double x = arc.radius_m * std::cos(s * arc.angle_rad);
  const double y = arc.radius_m * std::sin(s * arc.angle_rad);
  return {{arc.centre_m[0] + x * arc.u[0] + y * arc.v[0], arc.centre_m[1] + x * arc.u[1] + y * arc.v[1],
           arc.centre_m[2] + x * arc.u[2] + y * arc.v[2]},
          orientation_at(arc.tool, s),
          angles_at(arc.tool, s)};
}

/// Returns the first derivative of the position by s.
[[nodiscard]] inline Vector3 velocity_at(const LineMotion& line, double) noexcept {
  return line.to_m - line.from_m;
}
[[nodiscard]] inline Vector3 velocity_at(const ArcMotion& arc, double s) noexcept {
  const double speed = arc.radius_m * arc.angle_rad;
  return speed * std::cos(s * arc.angle_rad) * arc.v - speed * std::sin(s * arc.angle_rad) * arc.u;
}

[[nodiscard]] inline double length_m(const LineMotion& line) noexcept {
  return std::hypot(line.to_m[0] - line.from_m[0], line.to_m[1] - line.from_m[1],
                    line.to_m[2] - line.from_m[2]);
}

[[nodiscard]] inline double length_m(const ArcMotion& arc) noexcept { return arc.radius_m * arc.angle_rad; }

}  // namespace corbot
