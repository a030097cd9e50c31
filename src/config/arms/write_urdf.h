// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "corbot/arm/arm_model.h"

namespace corbot::config {

/// Names of the first and the last link of what write_urdf() writes.
inline constexpr const char* kUrdfBase = "base_link";
inline constexpr const char* kUrdfTip = "tool0";

/// The arm as a URDF: links `base_link`, `link_0` (frame 0), one after each joint, `flange` and `tool0`; joints with axis, range and
/// speed. Zero is a joint's 0. Numbers have all their digits, so that reading it gives the same forward kinematics within rounding.
/// A URDF asks for an effort; it is 0, since a profile knows none. `names`: one a joint, and the robot's.
[[nodiscard]] std::string write_urdf(const ArmModel& arm, const std::string& robot,
                                     std::span<const std::string> names);

}  // namespace corbot::config
