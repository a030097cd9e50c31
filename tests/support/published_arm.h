// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "arm_vectors.h"
#include "corbot/arm/arm_model.h"

namespace corbot::test {

/// With the ranges of these, and nominal limits.
inline ArmModel nominal_arm(const ArmVectors& vectors) {
  ArmModel arm;
  arm.kinematics = Kinematics::recognise(joint_chain(vectors.table));
  arm.dof = arm.kinematics.joint_count();
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const double unit = arm.kinematics.joint_kind(i) == JointKind::kRotary ? 1.0 : 0.2;
    arm.joints[i] = {vectors.lower_q[i], vectors.upper_q[i], 3.0 * unit, 15.0 * unit, 150.0 * unit};
  }
  arm.path = {0.25, 1.0, 10.0, 1.5, 7.0, 70.0};
  arm.gripper = {0, 1000.0, 2000.0, 0.5};
  return arm;
}

/// One of the published arms of tests/vectors/arms.
inline ArmModel published_arm(const std::string& name) { return nominal_arm(arm_vectors(name)); }

}  // namespace corbot::test
