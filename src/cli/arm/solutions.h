// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/arm/regularity.h"
#include "corbot/arm/arm_model.h"

namespace corbot::cli {

/// One of an arm's solutions at a pose.
struct PoseSolution {
  std::optional<std::uint32_t> number{};  ///< none for a solution of a numerical search
  Joints joints_q{};                      ///< at the turn within the ranges, if there is one
  std::vector<std::size_t> beyond_range;  ///< numbers of the joints beyond their ranges, from 0
  double orientation_error_rad{};         ///< 0 if only the position counts
  Regularity regularity{};
};

struct PoseSolutions {
  Pose pose{};  ///< as requested
  std::vector<PoseSolution> solutions;
  std::string refusal;  ///< why there is none
};

/// Returns all solutions, in closed form or numerically. Without `with_orientation` only the position counts,
/// and the orientation is the one nearest to the pose's that the arm can take. Turns count from `hint_q`.
[[nodiscard]] PoseSolutions solutions_at(const ArmModel& arm, const Pose& pose, bool with_orientation,
                                         const Joints& hint_q);

}  // namespace corbot::cli
