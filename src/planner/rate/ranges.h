// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/rate_knots.h"

// The joints' ranges along a path between knots.

namespace corbot::rate {

/// A place of the path where a joint is outside its range.
struct RangeBreach {
  std::size_t joint{};
  double position_q{};
  double lambda_s{};
};

/// Nothing: each joint is within its range, give or take kRangeTolerance_q, at every point of the path and not at samples alone. Else a
/// breach in the first cell that has one. At least two knots.
[[nodiscard]] std::optional<RangeBreach> find_breach(std::span<const Knot> knots, std::size_t dof,
                                                     const std::array<JointLimits, kMaxJoints>& limits);

}  // namespace corbot::rate
