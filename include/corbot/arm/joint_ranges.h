// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/joints.h"

namespace corbot {

/// The least and the greatest value of each joint.
struct JointRanges {
  Joints lower_q{};
  Joints upper_q{};
  friend bool operator==(const JointRanges&, const JointRanges&) = default;
};

}  // namespace corbot
