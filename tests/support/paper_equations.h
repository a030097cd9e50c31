// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "config/arms/four_axis.h"
#include "corbot/kinematics/angles.h"
#include "corbot/kinematics/ik_status.h"
#include "corbot/kinematics/joints.h"

// The closed form of section IV of 'A CORBA Wrapper for Applications with Multiple Robots'. It follows the
// paper, and corrects its print where it is wrong (docs/arms.md). Tests compare the kinematics of any arm
// with it, for the Lynx 5.

namespace corbot::paper {

using Arm = config::FourAxisLengths;

struct Pose {
  std::array<double, 3> position_m{};
  double yaw_rad{};    ///< θ0 with its offset
  double pitch_rad{};  ///< C: tool pitch above the horizontal, positive upward
};

struct Inverse {
  IkStatus status{IkStatus::kNotFinite};
  Joints joints_q{};
  double wrist_m{};  ///< P: shoulder to wrist, as the target asks
};

/// Bit 0: θ2 is negative. Bit 1: the base faces away.
[[nodiscard]] constexpr bool is_backward(std::uint32_t number) { return (number & 2u) != 0; }
[[nodiscard]] constexpr bool is_negative(std::uint32_t number) { return (number & 1u) != 0; }

/// Eqs. (3)–(5).
[[nodiscard]] inline Pose forward(const Arm& arm, const Joints& q) {
  const double a = q[1] + arm.offset_rad[1];
  const double b = a - (q[2] + arm.offset_rad[2]);
  const double c = b + (q[3] + arm.offset_rad[3]);
  const double r = arm.l1_m * std::cos(a) + arm.l2_m * std::cos(b) + arm.l3_m * std::cos(c);
  const double z = arm.l0_m + arm.l1_m * std::sin(a) + arm.l2_m * std::sin(b) + arm.l3_m * std::sin(c);
  const double yaw = q[0] + arm.offset_rad[0];
  return {{r * std::cos(yaw), r * std::sin(yaw), z}, yaw, c};
}

/// Eqs. (6)–(10), corrected, the elbow by its half angle.
[[nodiscard]] inline Inverse inverse(const Arm& arm, const std::array<double, 3>& p, double pitch_rad,
                                     std::uint32_t number) {
  Inverse result;
  const double sum = arm.l1_m + arm.l2_m;
  const double difference = std::abs(arm.l1_m - arm.l2_m);
  const double facing = is_backward(number) ? -1.0 : 1.0;
  const double u = facing * std::hypot(p[0], p[1]) - arm.l3_m * std::cos(pitch_rad);
  const double h = p[2] - arm.l0_m - arm.l3_m * std::sin(pitch_rad);
  const double wrist = result.wrist_m = std::hypot(u, h);  // (10)
  if (wrist > sum + 1e-12) {
    result.status = IkStatus::kTooFar;
    return result;
  }
  if (wrist < difference - 1e-12) {
    result.status = IkStatus::kTooClose;
    return result;
  }
  const double sign = is_negative(number) ? -1.0 : 1.0;
  const double y = std::sqrt(std::fmax(0.0, (sum - wrist) * (sum + wrist)));
  const double x = std::sqrt(std::fmax(0.0, (wrist - difference) * (wrist + difference)));
  const double elbow = sign * 2.0 * std::atan2(y, x);
  const double a =
      std::atan2(h, u) + std::atan2(sign * x * y, 2.0 * arm.l1_m * (arm.l1_m - arm.l2_m) + x * x);
  result.status = IkStatus::kOk;
  result.joints_q = {std::atan2(facing * p[1], facing * p[0]) - arm.offset_rad[0], a - arm.offset_rad[1],
                     elbow - arm.offset_rad[2], pitch_rad - a + elbow - arm.offset_rad[3]};
  return result;
}

}  // namespace corbot::paper
