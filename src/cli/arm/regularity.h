// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::cli {

/// The smallest singular value of the Jacobian (m and rad a unit of the joints) of what the arm follows, 0 at a singularity; and the
/// joint speeds, of length 1, that move the tool least.
struct Regularity {
  double smallest{};
  Joints idle_q_s{};
};
[[nodiscard]] Regularity regularity_at(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
