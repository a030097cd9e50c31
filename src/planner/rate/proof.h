// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "corbot/motion/rate_curve.h"
#include "planner/rate/geometry.h"
#include "planner/rate/pieces.h"

// Whether a rate along a path keeps all limits at every instant, not at samples alone.

namespace corbot::rate {

/// Speed, acceleration and jerk of each joint (rad or m, and s), and those of s by the tool's turning; on a line by its travel, too.
/// Infinite where nothing is limited, as beyond the arm's joints.
struct Limits {
  State speed{}, acceleration{}, jerk{};
  /// On an arc the tool's limits are those of vectors, in units of its length: along s″ and across angle · s′², and so on.
  double angle_rad{};  ///< of the arc; 0 on a line
  double arc_acceleration{}, arc_jerk{};
};
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const LineMotion& line) noexcept;
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const ArcMotion& arc) noexcept;

struct Proof {
  bool is_forward{true};       ///< false: lambda goes back somewhere, and nothing else is meaningful
  std::vector<Shares> pieces;  ///< bounds of the greatest of any limit, for each piece of the law
  double factor{};  ///< by which the law must be stretched to keep all limits; below 1 it may be quicker
};

/// All that are finite.
[[nodiscard]] std::vector<RateLimit> rate_limits(const Limits& limits);

/// Bounds that hold at every instant. On a stretch of time d within one piece and one cell, for any f, scalar or vector:
/// |f| <= max of both ends + d²/8 · max |f″|, the error of linear interpolation. The derivatives of z(lambda(t)) by time are bounded by the
/// chain rule from those of z by lambda and of lambda by time, which are bounded by the same formula.
/// `knots`: those of the law's path.
[[nodiscard]] Proof prove(const RateLaw& law, std::span<const Knot> knots, const Limits& limits);

}  // namespace corbot::rate
