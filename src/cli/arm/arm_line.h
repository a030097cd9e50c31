// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::cli {

/// An arm as a line in the base frame, m. It has the base, one point on each rotary axis next to the previous
/// one, the wrist or flange, and the tool.
struct ArmLine {
  struct Joint {
    JointKind kind{};
    Vector3 at_m{};  ///< the beginning of the slide for a sliding joint
  };
  std::vector<Vector3> points_m{};
  std::vector<Joint> joints{};
};

[[nodiscard]] ArmLine arm_line(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
