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

/// Without the reserves.
[[nodiscard]] Limits reserved(Limits limits) noexcept;

/// A motion without travel and rotation has two equal knots, and rests at the first. So does one of less than 1e-10 m and rad at a singularity,
/// where the joints carry more rounding than that.
struct RatePlan {
  std::vector<Knot> knots;
  RateLaw law;
  std::vector<Shares> shares;  ///< of the full limits, for each piece of the law
  RateCurve curve;             ///< of virtual time, by what the law leaves of the limits
};
using RatePlanned = std::variant<RatePlan, PlanRefusal>;

/// The law keeps the reserved limits at every instant, which is proved. It lasts `t_s` if that is feasible, else as short as possible.
/// Refused: what plan_geometry refuses.
[[nodiscard]] RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings,
                                    const LineMotion& line, const Joints& start_q, double t_s);
[[nodiscard]] RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings, const ArcMotion& arc,
                                    const Joints& start_q, double t_s);

}  // namespace corbot::rate
