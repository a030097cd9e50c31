// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/motion/time_law.h"

namespace corbot {

/// Magnitudes, all greater than 0; units follow the law's distance.
struct LawLimits {
  double velocity{};
  double acceleration{};
  double jerk{};
};

/// The time-optimal rest-to-rest law under the limits. A distance of 0 (or one so small that no duration can
/// be computed for it) gives the law of no duration. `distance` must be finite.
[[nodiscard]] TimeLaw plan_law(double distance, const LawLimits& limits) noexcept;

/// The same law in exactly `duration_s` seconds (to rounding), every segment scaled alike: velocity falls
/// with the factor, acceleration with its square, jerk with its cube. A law of no distance becomes one of
/// pure waiting.
[[nodiscard]] TimeLaw stretch(const TimeLaw& law, double duration_s) noexcept;

}  // namespace corbot
