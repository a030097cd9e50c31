// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "corbot/arm/shape_numbers.h"
#include "planner/plan/plan.h"

// Planes and boxes that clients set beside the profile's. Each check returns why a robot refuses a value.

namespace corbot {

/// Returns a plane or box without its name. Refuses what is not finite, too far or flat, and parts that the
/// arm does not have.
[[nodiscard]] std::variant<WorkspaceShape, PlanRefusal> checked_shape(const ArmModel& arm, ShapeKind kind,
                                                                      std::uint32_t parts,
                                                                      const ShapeNumbers& numbers);
/// Refuses shapes if a part of the arm, in the frames of the settings, stands beyond one of them.
[[nodiscard]] std::optional<PlanRefusal> check_stands_within(const ArmModel& arm,
                                                             const PlanSettings& settings,
                                                             const FurtherShapes& further,
                                                             const Joints& position_q);

}  // namespace corbot
