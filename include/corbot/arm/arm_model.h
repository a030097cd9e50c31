// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "corbot/arm/workspace_limits.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/joints.h"

namespace corbot {

/// The bounds of one joint: radians if it turns, metres if it slides. All limits but the range are magnitudes
/// and positive.
struct JointLimits {
  double lower_q{};
  double upper_q{};
  double speed_q_s{};
  double acceleration_q_s2{};
  double jerk_q_s3{};
};

/// The bounds of the tool centre point's motion on a line or an arc, at Speed(100).
struct PathLimits {
  double speed_m_s{};
  double acceleration_m_s2{};
  double jerk_m_s3{};
  double rotation_speed_rad_s{};  ///< of the tool
  double rotation_acceleration_rad_s2{};
  double rotation_jerk_rad_s3{};
};

/// Maps one joint to one servo: pulse = zero + direction · us_per_q · q, then bounded.
struct ServoMap {
  std::uint32_t channel{};
  double zero_us{};       ///< pulse width at joint value 0
  double us_per_q{};      ///< scale per rad or m, positive
  double direction{1.0};  ///< +1 or −1
  double pulse_min_us{};
  double pulse_max_us{};
};

/// The gripper: a servo between two pulse widths. Opening 0 = closed, 1 = open.
struct GripperModel {
  std::uint32_t channel{};
  double closed_us{};
  double open_us{};
  double travel_s{};  ///< time from closed to open at full speed, greater than 0
};

/// Describes an arm for the real-time cycle and the planner. Plain data: src/config validates and fills it,
/// and it is immutable afterwards. Both processes hold their own copy.
struct ArmModel {
  ArmKind kind{ArmKind::kAnthropomorphic};
  std::uint32_t dof{};  ///< 1 … kMaxJoints; 4 for the Lynx 5
  Kinematics kinematics{};
  std::array<JointLimits, kMaxJoints> joints{};
  PathLimits path{};
  /// The greatest orientation error allowed to an arm of fewer than six joints; 0: 1e-6 rad.
  double orientation_error_rad{};
  std::array<ServoMap, kMaxJoints> servos{};
  GripperModel gripper{};
  std::int64_t period_ns{1'000'000};  ///< period of the real-time loop
  WorkspaceLimits workspace{};
};
static_assert(std::is_trivially_copyable_v<ArmModel>);

}  // namespace corbot
