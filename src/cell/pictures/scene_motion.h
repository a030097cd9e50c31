// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cell/scene_record.h"

namespace corbot::cell {

/// How much the arms of a run moved, from the first motion of an arm to the last.
struct SceneMotion {
  double begin_s{};  ///< of the record's time
  double duration_s{};
  double both_move_share{};                    ///< of the duration: two arms or more moved
  std::map<std::string, double> moving_share;  ///< by the arm's name
};

struct TimeSpan {
  double from_s{};
  double to_s{};
};

/// When an arm moved: a point of it by 2 mm/s or more. Pauses shorter than `shortest_pause_s` are left out.
[[nodiscard]] std::vector<TimeSpan> moving_spans(const SceneRecord& record, std::size_t arm,
                                                 double shortest_pause_s = 0);

/// All 0 where no arm moved.
[[nodiscard]] SceneMotion scene_motion(const SceneRecord& record);

}  // namespace corbot::cell
