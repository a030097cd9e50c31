// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "planner/reach_region.h"

namespace corbot::cli {

/// A closed line, m; its last point joins the first.
using Outline = std::vector<PlanePoint>;

/// Returns the border of the marked cells: one line around each part and one around each hole. The lines are
/// smooth and within about a cell of the border.
[[nodiscard]] std::vector<Outline> outlines_of(const ReachRegion& region);

}  // namespace corbot::cli
