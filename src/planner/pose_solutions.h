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
  std::uint32_t
      number{};  ///< as its family counts them; of an arm without a closed form, in the order in which they are given
  Joints joints_q{};  ///< rotary ones at the turn within the ranges next to the hint, where there is one
  bool in_range{};    ///< of the ranges that motions keep
  double orientation_error_rad{};
};

/// All of them, with the settings' frames and ranges, whatever their orientation error; or why there is none (bad parameter,
/// unreachable). Some 10 ms for an arm without a closed form.
[[nodiscard]] std::variant<std::vector<PoseSolution>, PlanRefusal> solutions_at(const ArmModel& model,
                                                                                const PlanSettings& settings,
                                                                                const Pose& pose,
                                                                                const Joints& hint_q);

/// The number of the solution on which these joints lie, the smallest of those that they are common to; nothing where there is no
/// closed form.
[[nodiscard]] std::optional<std::uint32_t> solution_in_use(const ArmModel& model,
                                                           const PlanSettings& settings,
                                                           const Joints& joints_q) noexcept;

}  // namespace corbot
