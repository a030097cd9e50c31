// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path_knots.h"
#include "planner/plan/plan.h"

namespace corbot {

using KnotPlan = std::variant<std::vector<PathKnot>, PlanRefusal>;

/// The joints along a line or an arc from `start_q`, at which its first point is: solved numerically from knot to knot, so that the arm
/// stays on the solution on which it stands, in pieces as long as the error allows, each proved to be within numeric::kTracking everywhere.
/// Joint ranges and speeds are PathProof's concern. Refused where the path leads out of reach, to a singularity, or needs more
/// than kMostKnots knots.
[[nodiscard]] KnotPlan plan_knots(const ArmModel& model, const LineMotion& line, const Joints& start_q);
[[nodiscard]] KnotPlan plan_knots(const ArmModel& model, const ArcMotion& arc, const Joints& start_q);

}  // namespace corbot
