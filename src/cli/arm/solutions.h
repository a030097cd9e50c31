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
  std::optional<std::uint32_t> number{};  ///< none where it was found numerically
  Joints joints_q{};                      ///< at the turn within the ranges where there is one
  std::vector<std::size_t> beyond_range;  ///< joints that are, from 0; empty: the arm can stand there
  double orientation_error_rad{};         ///< 0 where the position alone counts
  Regularity regularity{};
};

struct PoseSolutions {
  Pose pose{};  ///< asked for
  std::vector<PoseSolution> solutions;
  std::string refusal;  ///< why there is none
};

/// All solutions, in closed form or numerically. `with_orientation`: else the position alone counts, and the orientation is the
/// nearest one to the pose's that the arm has. `hint_q`: where turns are counted from.
[[nodiscard]] PoseSolutions solutions_at(const ArmModel& arm, const Pose& pose, bool with_orientation,
                                         const Joints& hint_q);

}  // namespace corbot::cli
