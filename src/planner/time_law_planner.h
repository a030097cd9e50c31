// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/motion/time_law.h"

namespace corbot {

/// Magnitudes, all greater than 0, in the units of the law's distance.
struct LawLimits {
  double velocity{};
  double acceleration{};
  double jerk{};
};

/// Returns the time-optimal rest-to-rest law under the limits. A distance of 0, or one too small to have a
/// duration, gives the law of no duration. `distance` must be finite.
[[nodiscard]] TimeLaw plan_law(double distance, const LawLimits& limits) noexcept;

/// Returns the same law in exactly `duration_s` seconds (to rounding), with all segments scaled alike.
/// Velocity falls with the factor, acceleration with its square, jerk with its cube. A law without distance
/// becomes a pure wait.
[[nodiscard]] TimeLaw stretch(const TimeLaw& law, double duration_s) noexcept;

}  // namespace corbot
