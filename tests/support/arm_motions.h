// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "corbot/kinematics/tool_pose.h"
#include "planner/planner.h"

namespace corbot::test {

/// Motions of every kind that an arm can do, found by asking its planner: what an arm's place and size are
/// needs no table here.
struct ArmMotions {
  using Point = std::array<double, 3>;

  Joints there_q{};       ///< where the lines and arcs begin, within reach of joints at 0
  PlanSettings settings;  ///< which keep the tool as it is there
  std::optional<Point>
      line_to_m;  ///< a line of `size_m` along one of the base frame's axes; empty where no place was found
  std::array<Point, 2> arc_m{};  ///< and an arc through the first to the second, of about that size
};

namespace detail {

inline bool is_planned(const PlanResult& result) {
  return std::holds_alternative<std::vector<Command>>(result);
}

inline bool find_paths(const Planner& planner, const Kinematics& arm, double size_m, ArmMotions& found) {
  const PlanStart start{found.there_q, 0.0};
  const auto p = tool_pose(arm, found.there_q).position_m;
  for (const auto& [along, across] : {std::pair{1u, 0u}, {1u, 2u}, {0u, 2u}}) {
    for (const auto& [ahead_m, aside_m] :
         {std::pair{size_m, size_m}, {size_m, -size_m}, {-size_m, -size_m}}) {
      auto line = p, first = p, second = p;
      line[along] += ahead_m;
      first[across] += 0.3 * aside_m;
      first[along] += 0.3 * ahead_m;
      second[along] += 0.6 * ahead_m;
      const PlanResult there = planner.move_s(start, found.settings, line, 0.0);
      if (!is_planned(there) || !is_planned(planner.move_c(start, found.settings, p, first, second)))
        continue;
      // And back again.
      const PlanStart end{std::get<std::vector<Command>>(there).back().end_q, 0.0};
      if (!is_planned(planner.move_s(end, found.settings, p, 0.0))) continue;
      found.line_to_m = line;
      found.arc_m = {first, second};
      return true;
    }
  }
  return false;
}

}  // namespace detail

/// From where the arm is when it is ready, joints at 0; without a line where none begins there.
inline ArmMotions motions_from_ready(const ArmModel& arm, double size_m) {
  ArmMotions found;
  (void)detail::find_paths(Planner(arm), arm.kinematics, size_m, found);
  return found;
}

/// From joints within the inner part of their ranges.
inline ArmMotions motions_of(const ArmModel& arm, double size_m = 0.03) {
  const Planner planner(arm);
  std::mt19937_64 random(1);
  ArmMotions found;
  for (int tries = 0; tries < 200; ++tries) {
    for (std::size_t i = 0; i < arm.dof; ++i) {
      found.there_q[i] =
          0.4 * std::uniform_real_distribution<double>(arm.joints[i].lower_q, arm.joints[i].upper_q)(random);
    }
    if (arm.kinematics.follows() == Follows::kPitch) {
      found.settings.tool_pitch_rad = tool_pose(arm.kinematics, found.there_q).pitch_rad;
    }
    if (detail::find_paths(planner, arm.kinematics, size_m, found)) return found;
  }
  return found;
}

}  // namespace corbot::test
