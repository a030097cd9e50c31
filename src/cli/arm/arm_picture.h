// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/profile.h"

namespace corbot::cli {

/// An SVG: the arm at these joints and where its tool centre point gets, from the side and from above, to one scale with axes in
/// metres. From the side joint 1 of an arm that turns about the vertical stands where it is; else all joints move.
[[nodiscard]] std::string arm_picture(const Profile& profile, const Joints& q);

/// The points that the picture joins by lines: base, one on each turning axis next to the one before, wrist or flange, tool; base frame.
[[nodiscard]] std::vector<Vector3> arm_line(const Kinematics& arm, const Joints& q);

}  // namespace corbot::cli
