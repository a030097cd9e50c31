// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/profile.h"
#include "planner/workspace.h"

namespace corbot::cli {

/// Returns probable mistakes in a valid profile's geometry. Examples: the wrong D-H convention, radians for
/// degrees, millimetres for metres, a flat workspace, an arm that is singular wherever its joints are near 0.
/// Returns an empty list if there is no doubt.
[[nodiscard]] std::vector<std::string> doubts_of(const Profile& profile, const Workspace& workspace);

}  // namespace corbot::cli
