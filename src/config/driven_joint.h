// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/joints.h"

namespace corbot {

/// A joint, as far as the device that drives it must know it.
struct DrivenJoint {
  JointKind kind{JointKind::kRotary};
  double farthest_q{};  ///< of its range from 0
};

}  // namespace corbot
