// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/joints.h"

namespace corbot {

/// The properties of a joint that its device needs.
struct DrivenJoint {
  JointKind kind{JointKind::kRotary};
  double farthest_q{};  ///< largest distance of its range from 0
};

}  // namespace corbot
