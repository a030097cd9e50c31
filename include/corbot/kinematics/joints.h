// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace corbot {

/// The interface's bound: an arm has at most six joints (robot.idl: sequence<double, 6>).
inline constexpr std::size_t kMaxJoints = 6;

/// Servos of one arm: one for each joint, one for the gripper, one spare.
inline constexpr std::size_t kMaxServos = 8;

/// A joint turns (radians) or slides (metres).
enum class JointKind : std::uint32_t { kRotary, kPrismatic };

/// One value for each joint; entries at and beyond the arm's degrees of freedom are zero. The name of a
/// variable gives the unit: `_q`, `_q_s`, … are rad, rad/s, … for a turning joint and m, m/s, … for a sliding
/// one.
using Joints = std::array<double, kMaxJoints>;

}  // namespace corbot
