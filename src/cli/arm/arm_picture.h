// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/profile.h"

namespace corbot::cli {

enum class PictureSize { kFull, kThumbnail };

/// An SVG: the arm at these joints and where its tool centre point gets, from the side and from above, to one
/// scale. From the side joint 1 of an arm that turns about the vertical stands where it is; else all joints
/// move. A thumbnail, for tables, has a bar for its scale instead of axes and legend. Colours are told apart
/// by the colour-blind, and follow a dark screen.
[[nodiscard]] std::string arm_picture(const Profile& profile, const Joints& q,
                                      PictureSize size = PictureSize::kFull);

}  // namespace corbot::cli
