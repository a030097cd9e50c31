// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace corbot {

/// The interface's bound: an arm has at most six joints (robot.idl: sequence<double, 6>).
inline constexpr std::size_t kMaxJoints = 6;

/// Servos of one arm: one a joint, one for the gripper, one spare.
inline constexpr std::size_t kMaxServos = 8;

/// A joint turns (radians) or slides (metres).
enum class JointKind : std::uint32_t { kRotary, kPrismatic };

/// One value a joint; entries at and beyond the arm's degrees of freedom are zero.
/// Unit by name of the variable: `_q`, `_q_s`, … are rad, rad/s, … of a joint that turns and m, m/s, … of one
/// that slides.
using Joints = std::array<double, kMaxJoints>;

}  // namespace corbot
