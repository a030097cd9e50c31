// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cell/scene_record.h"

namespace corbot::cell {

/// The extent of the arms' motion in a run, from the first motion of an arm to the last.
struct SceneMotion {
  double begin_s{};  ///< time of the first motion, in the record's time
  double duration_s{};
  double both_move_share{};                    ///< share of the duration in which at least two arms moved
  std::map<std::string, double> moving_share;  ///< shares of the duration, by the arm's name
};

struct TimeSpan {
  double from_s{};
  double to_s{};
};

/// Returns the times in which an arm moved, that is, one of its points had at least 2 mm/s. Ignores pauses
/// shorter than `shortest_pause_s`.
[[nodiscard]] std::vector<TimeSpan> moving_spans(const SceneRecord& record, std::size_t arm,
                                                 double shortest_pause_s = 0);

/// Returns the arms' motion in a run; all 0 if no arm moved.
[[nodiscard]] SceneMotion scene_motion(const SceneRecord& record);

}  // namespace corbot::cell
