// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot {

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

/// The largest distance of the tool centre point from the shoulder, m: the stretched planar arm's, whatever its ranges; else within the joints'
/// ranges from where axis 1 is nearest to axis 2, or from axis 1 where the two are parallel or joint 2 slides. 0: joint 1
/// slides, there is no shoulder.
[[nodiscard]] double reach_m(const ArmModel& arm);

}  // namespace corbot
