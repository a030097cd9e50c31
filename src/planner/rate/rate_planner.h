// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>
#include <vector>

#include "corbot/motion/rate_curve.h"
#include "planner/rate/geometry.h"
#include "planner/rate/pieces.h"
#include "planner/rate/proof.h"

// Lines and arcs at the limits of every joint and of the tool.

namespace corbot::rate {

/// Returns the limits without the reserves.
[[nodiscard]] Limits reserved(Limits limits) noexcept;

/// The plan of a line or an arc. A motion without travel and rotation has two equal knots and rests at the
/// first. The same holds at a singularity for a motion of less than 1e-10 m and rad: the joints' rounding
/// error is larger there.
struct RatePlan {
  std::vector<Knot> knots;
  RateLaw law;
  std::vector<Shares> shares;  ///< of the full limits, for each piece of the law
  RateCurve curve;             ///< of virtual time, by the part of the limits that the law leaves
};
using RatePlanned = std::variant<RatePlan, PlanRefusal>;

/// Plans a law that keeps the reserved limits at every instant, which is proved. The law lasts `t_s` if that
/// is feasible, else as short as possible. Refuses the paths that plan_geometry refuses.
[[nodiscard]] RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings,
                                    const LineMotion& line, const Joints& start_q, double t_s);
[[nodiscard]] RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings, const ArcMotion& arc,
                                    const Joints& start_q, double t_s);

}  // namespace corbot::rate
