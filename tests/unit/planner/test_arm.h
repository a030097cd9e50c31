// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "config/arms/four_axis.h"
#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "inverse_at_pitch.h"

namespace corbot::test {

constexpr double deg(double degrees) { return to_radians(degrees); }

/// A four-axis arm with the Lynx 5's offsets.
inline Kinematics four_axis(double l0_m, double l1_m, double l2_m, double l3_m) {
  return Kinematics::recognise(
      joint_chain(config::four_axis_table({l0_m, l1_m, l2_m, l3_m, {0.0, deg(10), 0.0, deg(-45)}})));
}

/// The nominal Lynx 5, as profiles/lynx5.toml has it in essence.
inline ArmModel lynx5() {
  ArmModel arm;
  arm.dof = 4;
  arm.kinematics = four_axis(0.067, 0.120, 0.120, 0.100);
  arm.joints[0] = {deg(-90), deg(90), deg(180), deg(900), deg(8000)};
  arm.joints[1] = {deg(-30), deg(130), deg(150), deg(800), deg(8000)};
  arm.joints[2] = {deg(-30), deg(130), deg(150), deg(800), deg(8000)};
  arm.joints[3] = {deg(-90), deg(90), deg(200), deg(1000), deg(8000)};
  arm.path = {0.25, 1.0, 10.0, deg(90), deg(400), deg(4000)};
  arm.gripper = {4, 1000.0, 2000.0, 0.5};
  return arm;
}

/// Ranges wide enough for every branch.
inline ArmModel wide_arm() {
  ArmModel arm = lynx5();
  for (JointLimits& limits : arm.joints) {
    limits.lower_q = deg(-180);
    limits.upper_q = deg(180);
  }
  return arm;
}

inline std::array<double, 3> tcp_of(const ArmModel& arm, const Joints& q) {
  return tool_pose(arm.kinematics, q).position_m;
}

inline double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace corbot::test
