// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "corbot/kinematics/joint_chain.h"
#include "corbot/units.h"

// Units in which people and clients see a joint's values, and what counts as near for a joint. Real-time
// safe.

namespace corbot {

using JointKinds = std::array<JointKind, kMaxJoints>;

[[nodiscard]] inline JointKinds kinds_of(const JointChain& chain) noexcept {
  JointKinds kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) kinds[i] = chain.axes[i].kind;
  return kinds;
}

/// Converts a value from rad or m (`_q`, inside) to degrees or metres (profiles, messages, CORBA interface).
/// The same functions convert speeds.
[[nodiscard]] constexpr double to_shown(JointKind kind, double value_q) noexcept {
  return kind == JointKind::kRotary ? to_degrees(value_q) : value_q;
}
[[nodiscard]] constexpr double from_shown(JointKind kind, double value) noexcept {
  return kind == JointKind::kRotary ? to_radians(value) : value;
}
[[nodiscard]] constexpr const char* unit_name(JointKind kind) noexcept {
  return kind == JointKind::kRotary ? "degrees" : "m";
}
/// Returns the decimals to show for a value that would have `of_degrees` decimals in degrees: a degree moves
/// the end of a link by millimetres.
[[nodiscard]] constexpr int decimals(JointKind kind, int of_degrees) noexcept {
  return kind == JointKind::kRotary ? of_degrees : of_degrees + 3;
}

/// The distance that the end of a link moves per radian, for an arm on a table; a round figure of the arms in
/// profiles/.
inline constexpr double kTypicalLink_m = 0.3;

/// Converts a tolerance given for a turning joint (rad) to one for this joint (rad or m). A sliding joint may
/// miss as much as the end of a typical link would: a degree becomes 5 mm, 2 mrad become 0.6 mm. The function
/// converts tolerances of speeds, too.
[[nodiscard]] constexpr double near_q(JointKind kind, double angle_rad) noexcept {
  return kind == JointKind::kRotary ? angle_rad : angle_rad * kTypicalLink_m;
}

}  // namespace corbot
