// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// The reach of the tool centre point within the joints' ranges, base frame, m. A search finds the extremes
/// from random joints, the same in each run.
struct Workspace {
  std::array<std::array<double, 2>, 3> extent_m{};  ///< x, y, z: least and greatest
  bool about_axis{};                 ///< joint 1 turns about a vertical axis, and `radius_m` is valid
  Vector3 axis_m{};                  ///< a point of the axis
  std::array<double, 2> radius_m{};  ///< horizontal distance from the axis: least and greatest
};

[[nodiscard]] Workspace workspace_of(const ArmModel& arm);

/// Returns tool positions at random joints within the ranges. `joint1_q` fixes joint 1.
[[nodiscard]] std::vector<Vector3> sample_positions(const ArmModel& arm, std::size_t count,
                                                    std::optional<double> joint1_q);

/// Returns the largest distance of the tool centre point from the shoulder, m. For a planar arm the arm is
/// stretched, whatever its ranges. Else the joints stay in their ranges, and the shoulder is the point of
/// axis 1 nearest to axis 2. If the two are parallel or joint 2 slides, axis 1 itself is the reference.
/// Returns 0 if joint 1 slides: there is no shoulder.
[[nodiscard]] double reach_m(const ArmModel& arm);

}  // namespace corbot
