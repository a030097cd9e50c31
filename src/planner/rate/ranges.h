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

/// Returns a breach in the first cell that has one. Returns nothing if each joint is within its range, to
/// kRangeTolerance_q, at every point of the path and not only at samples. Needs at least two knots.
[[nodiscard]] std::optional<RangeBreach> find_breach(std::span<const Knot> knots, std::size_t dof,
                                                     const std::array<JointLimits, kMaxJoints>& limits);

}  // namespace corbot::rate
