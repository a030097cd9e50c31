// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::cli {

/// Distance of the arm from a singularity. `smallest` is the smallest singular value of the Jacobian of the
/// followed coordinates, 0 at a singularity. Its unit is m and rad per unit of the joints. `idle_q_s` is the
/// vector of joint speeds, of length 1, that moves the tool least.
struct Regularity {
  double smallest{};
  Joints idle_q_s{};
};
[[nodiscard]] Regularity regularity_at(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
