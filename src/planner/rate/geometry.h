// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/rate_knots.h"
#include "planner/plan/plan.h"

// The knots of a line or an arc.

namespace corbot::rate {

using KnotList = std::variant<std::vector<Knot>, PlanRefusal>;

/// Returns knots from s = 0 to s = 1, at most kMostKnots, the first with lambda 0. At a few points of each
/// cell the tool is within 1e-8 m (rad) of the path. There each joint's third derivative is accurate to 3 %
/// of its jerk limit. A path that would need more knots gets 1e-7 and 60 %, or 1 % of the third derivative
/// itself if that is more. The last tolerances are 5 % and more of it.
/// `start_q`: joints at the first point. `speed`: full speeds of z from limits_of(); all of the arm's entries
/// are finite and positive. A path along a singularity holds the joint that is free there.
/// A path may begin or end at a singularity if the arm has a closed form. It may lead through one if the
/// curve continues smoothly on another solution. There the tool is within 5e-7 m (rad) of the path, so a path
/// that misses the place by less is led through it. A path is refused if it leaves the reach, leads through
/// any other singularity, or needs too many knots. Joint ranges are not checked.
[[nodiscard]] KnotList plan_geometry(const ArmModel& model, const LineMotion& line, const Joints& start_q,
                                     const State& speed);
[[nodiscard]] KnotList plan_geometry(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
                                     const State& speed);

}  // namespace corbot::rate
