// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <variant>

#include "corbot/motion/command.h"
#include "planner/plan/plan.h"

namespace corbot {

/// Points of an arc nearer to each other than this count as coincident.
inline constexpr double kCoincident_m = 1e-9;
/// Three points whose triangle is flatter than this (|a × b| over the square of its longest side) count as
/// collinear: beyond it the radius exceeds 500,000 times the chord,
/// and the centre is no longer known to a millimetre.
inline constexpr double kCollinear = 1e-6;

/// Circle through the three points, travelled from p1 over p2 to p3: centre, u, v, radius, angle filled,
/// everything else zero. Coordinates must be finite.
[[nodiscard]] std::variant<ArcMotion, PlanRefusal> arc_through(const std::array<double, 3>& p1_m,
                                                               const std::array<double, 3>& p2_m,
                                                               const std::array<double, 3>& p3_m);

}  // namespace corbot
