// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "corbot/motion/rate_proof.h"
#include "planner/rate/geometry.h"
#include "planner/rate/pieces.h"

// The proof of a whole law.

namespace corbot::rate {

/// At the settings' ratios of speed.
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const LineMotion& line) noexcept;
[[nodiscard]] Limits limits_of(const ArmModel& model, const PlanSettings& settings,
                               const ArcMotion& arc) noexcept;

struct Proof {
  bool is_forward{true};       ///< false: lambda goes back somewhere, and nothing else is meaningful
  std::vector<Shares> pieces;  ///< bounds of the greatest of any limit, for each piece of the law
  double factor{};  ///< by which the law must be stretched to keep all limits; below 1 it may be quicker
};

/// See ProofWalk. `knots`: those of the law's path.
[[nodiscard]] Proof prove(const RateLaw& law, std::span<const Knot> knots, const Limits& limits);

}  // namespace corbot::rate
