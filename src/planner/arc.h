// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <variant>

#include "corbot/motion/command.h"
#include "planner/plan/plan.h"

namespace corbot {

/// Points of an arc that are nearer to each other than this count as coincident.
inline constexpr double kCoincident_m = 1e-9;
/// Three points count as collinear if their triangle is flatter than this: |a × b| over the square of its
/// longest side. For flatter triangles the radius exceeds 500,000 times the chord, and the centre is not
/// accurate to a millimetre.
inline constexpr double kCollinear = 1e-6;

/// Returns the circle through the three points, travelled from p1 over p2 to p3. Fills in centre, u, v,
/// radius and angle; all else is zero. Coordinates must be finite.
[[nodiscard]] std::variant<ArcMotion, PlanRefusal> arc_through(const std::array<double, 3>& p1_m,
                                                               const std::array<double, 3>& p2_m,
                                                               const std::array<double, 3>& p3_m);

}  // namespace corbot
