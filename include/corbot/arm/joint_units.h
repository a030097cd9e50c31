// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "corbot/kinematics/joint_chain.h"
#include "corbot/units.h"

// How a joint's values are shown to people and clients, and what is near for a joint. Real-time safe.

namespace corbot {

using JointKinds = std::array<JointKind, kMaxJoints>;

[[nodiscard]] inline JointKinds kinds_of(const JointChain& chain) noexcept {
  JointKinds kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) kinds[i] = chain.axes[i].kind;
  return kinds;
}

/// Inside, a value is rad or m (`_q`); profiles, messages and the CORBA interface have degrees or metres, and so for speeds.
[[nodiscard]] constexpr double to_shown(JointKind kind, double value_q) noexcept {
  return kind == JointKind::kRotary ? to_degrees(value_q) : value_q;
}
[[nodiscard]] constexpr double from_shown(JointKind kind, double value) noexcept {
  return kind == JointKind::kRotary ? to_radians(value) : value;
}
[[nodiscard]] constexpr const char* unit_name(JointKind kind) noexcept {
  return kind == JointKind::kRotary ? "degrees" : "m";
}
/// Decimals of a value that would have so many in degrees: a degree moves the end of a link by millimetres.
[[nodiscard]] constexpr int decimals(JointKind kind, int of_degrees) noexcept {
  return kind == JointKind::kRotary ? of_degrees : of_degrees + 3;
}

/// How far the end of a link of an arm for a table moves, a radian; a round figure of the arms in profiles/.
inline constexpr double kTypicalLink_m = 0.3;

/// What counts as near for a joint (rad or m), given for one that turns: one that slides may miss as much as the end of a typical link
/// would, so that a degree is 5 mm, and 2 mrad are 0.6 mm. Of speeds likewise.
[[nodiscard]] constexpr double near_q(JointKind kind, double angle_rad) noexcept {
  return kind == JointKind::kRotary ? angle_rad : angle_rad * kTypicalLink_m;
}

}  // namespace corbot
