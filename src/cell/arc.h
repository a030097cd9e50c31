// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

namespace corbot::cell {

/// Rise of an arc's middle over the mean height of its ends. It keeps the three points off one line.
inline constexpr double kArcRise_m = 0.010;

/// Returns the middle point of the arc between two points, all in the robot's frame: half-way about the
/// robot's axis, at the mean distance from the axis.
[[nodiscard]] inline Eigen::Vector3d middle_of_arc(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const auto angle_of = [](const Eigen::Vector3d& point) { return std::atan2(point.y(), point.x()); };
  const double begin_rad = angle_of(from);
  const double turn_rad = std::remainder(angle_of(to) - begin_rad, 2 * std::numbers::pi);
  const double middle_rad = begin_rad + turn_rad / 2;
  const double radius_m = (from.head<2>().norm() + to.head<2>().norm()) / 2;
  return {radius_m * std::cos(middle_rad), radius_m * std::sin(middle_rad),
          (from.z() + to.z()) / 2 + kArcRise_m};
}

}  // namespace corbot::cell
