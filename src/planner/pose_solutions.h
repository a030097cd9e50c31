// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"

namespace corbot {

/// One of the arm's solutions at a pose.
struct PoseSolution {
  std::uint32_t number{};  ///< number in its family; without a closed form, its index in the list
  Joints joints_q{};  ///< rotary joints at the turn within the ranges that is nearest to the hint, if any
  bool in_range{};    ///< within the ranges that motions keep
  double orientation_error_rad{};
};

/// Returns all solutions, with the settings' frames and ranges and any orientation error. If there is none,
/// returns the reason (bad parameter, unreachable). Takes some 10 ms for an arm without a closed form.
[[nodiscard]] std::variant<std::vector<PoseSolution>, PlanRefusal> solutions_at(const ArmModel& model,
                                                                                const PlanSettings& settings,
                                                                                const Pose& pose,
                                                                                const Joints& hint_q);

/// Returns the number of the solution on which these joints lie, the smallest if there are several. Returns
/// nothing without a closed form.
[[nodiscard]] std::optional<std::uint32_t> solution_in_use(const ArmModel& model,
                                                           const PlanSettings& settings,
                                                           const Joints& joints_q) noexcept;

}  // namespace corbot
