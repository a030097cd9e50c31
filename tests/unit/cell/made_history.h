// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/cell/work_history.h"

namespace corbot::test {

/// 112 s of two robots: a second is 10 units of the chart. robot1 is in the zone for 28 s, robot2 for 14 s.
inline cli::WorkHistory made_history() {
  using cell::Activity;
  using cli::Milestone;
  constexpr double kBegin_s = 1700000000;
  cli::WorkHistory history;
  history.robots = {"robot1", "robot2"};
  const auto from = [&](double at_s, const char* robot, Activity activity, std::uint64_t piece,
                        const char* zone) {
    history.activities.push_back({kBegin_s + at_s, robot, activity, piece, zone});
  };
  from(-5, "robot1", Activity::kMoving, 0, "");
  from(-5, "robot2", Activity::kWaitingForPiece, 0, "");
  from(0, "robot1", Activity::kMoving, 1, "");
  from(20, "robot1", Activity::kLooking, 1, "");
  from(22, "robot1", Activity::kMoving, 1, "store1");
  from(50, "robot2", Activity::kWaitingForZone, 1, "");
  from(50, "robot1", Activity::kIdle, 0, "");
  from(56, "robot2", Activity::kMoving, 1, "store1");
  from(70, "robot2", Activity::kMoving, 1, "");
  from(120, "robot2", Activity::kIdle, 0, "");
  const auto reached = [&](double at_s, const char* robot, Milestone milestone, bool is_last) {
    history.milestones.push_back({kBegin_s + at_s, robot, 1, milestone, is_last});
  };
  reached(0, "robot1", Milestone::kReserved, false);
  reached(20, "robot1", Milestone::kHeld, false);
  reached(49, "robot1", Milestone::kPlaced, false);
  reached(49.5, "robot2", Milestone::kReserved, false);
  reached(70, "robot2", Milestone::kHeld, false);
  reached(112, "robot2", Milestone::kPlaced, true);
  return history;
}

}  // namespace corbot::test
