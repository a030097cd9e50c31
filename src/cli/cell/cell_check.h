// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cell/program.h"

// Plans a worker's motions without carrying them out: to its wait pose, then from there to each slot.

namespace corbot::cli {

/// A motion to a point of cell.toml that the robot would refuse.
struct RefusedPoint {
  std::string key;          ///< "robot[0].wait_m", "place[1] store1, slot 3, red"
  std::string motion;       ///< "the line to the grasp"
  Eigen::Vector3d point_m;  ///< end of the motion, in the robot's frame
  std::string why;          ///< text of the planner
};

struct ReachCheck {
  std::size_t points{0};  ///< number of checked points: the wait pose, each grasp, each approach
  std::vector<RefusedPoint> refused;
};

/// Plans the motions of the robot's worker; the arm begins with all joints at 0. Nine spots represent an
/// area: its corners, the middles of its edges, and its middle, moved inwards so that a whole piece fits. A
/// robot that runs elsewhere plans itself, from its present position, a free motion to each point. Throws
/// client::Failure if the profile cannot be read, the robot does not reply, or the object is no Arm.
[[nodiscard]] ReachCheck check_reach(const cell::CellConfig& cell, const cell::CellRobot& robot);

/// Prints the check of each robot. Throws client::Failure, kRefused, if a point is out of reach.
void cell_check(const cell::CellOptions& options);

}  // namespace corbot::cli
