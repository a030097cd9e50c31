// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/cell/work_history.h"

namespace corbot::cli {

/// Returns a Gantt chart of a run as an SVG file: a lane for each robot, time from left to right in seconds.
/// Bars show activities, and hairlines show when a piece was held and placed. The chart is readable from a
/// width of 400 pixels on, on light and dark ground, in grey, and without colour vision. Empty if no piece
/// was placed, or no activity is known.
[[nodiscard]] std::string gantt_svg(const WorkHistory& history);

/// The chart's units: the period of the work covers `kGanttLeft` to `kGanttRight` along x.
inline constexpr double kGanttLeft = 40;
inline constexpr double kGanttRight = 1160;

}  // namespace corbot::cli
