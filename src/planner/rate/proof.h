// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "corbot/motion/rate_proof.h"
#include "planner/rate/geometry.h"
#include "planner/rate/pieces.h"

// The proof of a whole law.

namespace corbot::rate {

/// Return the limits at the settings' ratios of speed.
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const LineMotion& line) noexcept;
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const ArcMotion& arc) noexcept;

struct Proof {
  bool is_forward{true};       ///< false: lambda decreases somewhere, and nothing else is valid
  std::vector<Shares> pieces;  ///< for each piece of the law, a bound of the greatest share of any limit
  double factor{};             ///< stretch with which the law keeps all limits; below 1 it may be quicker
};

/// Proves a law, see ProofWalk. `knots` are those of the law's path.
[[nodiscard]] Proof prove(const RateLaw& law, std::span<const Knot> knots, const Limits& limits);

}  // namespace corbot::rate
