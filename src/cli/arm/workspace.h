// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot::cli {

/// Where the tool centre point gets within the joints' ranges, base frame, m: extremes found by a search from random joints, always
/// the same ones.
struct Workspace {
  std::array<std::array<double, 2>, 3> extent_m{};  ///< x, y, z: least and greatest
  bool about_axis{};                 ///< joint 1 turns about a vertical axis, and `radius_m` means something
  Vector3 axis_m{};                  ///< a point of it
  std::array<double, 2> radius_m{};  ///< from it, horizontally: nearest and farthest
};

[[nodiscard]] Workspace workspace_of(const ArmModel& arm);

/// Tool positions at random joints within the ranges; joint 1 stands where it is told to.
[[nodiscard]] std::vector<Vector3> sample_positions(const ArmModel& arm, std::size_t count,
                                                    std::optional<double> joint1_q);

/// The smallest singular value of the Jacobian (m and rad a unit of the joints) of what the arm follows, 0 at a singularity; and the
/// joint speeds, of length 1, that move the tool least.
struct Regularity {
  double smallest{};
  Joints idle_q_s{};
};
[[nodiscard]] Regularity regularity_at(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
