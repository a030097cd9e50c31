// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::cli {

/// An arm as a line in the base frame, m: base, one point on each turning axis next to the one before, wrist
/// or flange, tool.
struct ArmLine {
  struct Joint {
    JointKind kind{};
    Vector3 at_m{};  ///< a sliding joint's is where its slide begins
  };
  std::vector<Vector3> points_m{};
  std::vector<Joint> joints{};
};

[[nodiscard]] ArmLine arm_line(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
