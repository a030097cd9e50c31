// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/profile.h"

namespace corbot::cli {

enum class PictureSize { kFull, kThumbnail };

/// Returns an SVG of the arm at these joints and of the reach of its tool centre point. It shows both from
/// the side and from above, to one scale. Seen from the side, joint 1 of an arm that turns about the vertical
/// is fixed; in all other cases all joints move. A thumbnail, for tables, has a scale bar instead of axes and
/// legend. Colour-blind readers can distinguish the colours, which follow a dark screen.
[[nodiscard]] std::string arm_picture(const Profile& profile, const Joints& q,
                                      PictureSize size = PictureSize::kFull);

}  // namespace corbot::cli
