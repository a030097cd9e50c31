// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/section.h"
#include "corbot/kinematics/joints.h"

namespace corbot {

/// The keys of a joint whose names contain a unit, and their bounds: degrees for a rotary joint, metres for a
/// sliding one.
struct JointKeys {
  std::string_view range, speed, acceleration, jerk, following_error, goal_tolerance, home, servo_scale;
  std::string_view speed_unit, acceleration_unit, jerk_unit;
  Bounds value;  ///< of the joint's position
  Bounds following;
  Bounds goal;
  double usual_following, usual_goal;
  double si_per_unit;           ///< rad per degree, or 1
  double servo_units_per_unit;  ///< servo_scale counts degrees, or millimetres
  /// Reports the keys of `joint` with the other kind's unit. `why`: says that it rotates, or slides.
  void refuse_others(Section& joint, const std::string& why) const;
};

[[nodiscard]] const JointKeys& keys_of(JointKind kind) noexcept;

}  // namespace corbot
