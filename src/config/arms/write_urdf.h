// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "corbot/arm/arm_model.h"

namespace corbot::config {

/// Names of the first and the last link in the output of write_urdf().
inline constexpr const char* kUrdfBase = "base_link";
inline constexpr const char* kUrdfTip = "tool0";

/// Returns the arm as a URDF with the links `base_link`, `link_0` (frame 0), one after each joint, `flange`
/// and `tool0`. The joints have axis, range and speed; zero is a joint's 0. Numbers have all their digits, so
/// a reader gets the same forward kinematics within rounding. A URDF requires an effort; it is 0, since a
/// profile has none. `names`: one for each joint; `robot`: the robot's name.
[[nodiscard]] std::string write_urdf(const ArmModel& arm, const std::string& robot,
                                     std::span<const std::string> names);

}  // namespace corbot::config
