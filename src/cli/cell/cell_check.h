// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cell/program.h"

// A worker's motions, planned and not carried out: to its wait pose, then from there to each slot.

namespace corbot::cli {

/// A motion to a point of cell.toml that the robot would refuse.
struct RefusedPoint {
  std::string key;          ///< "robot[0].wait_m", "place[1] store1, slot 3, red"
  std::string motion;       ///< "the line to the grasp"
  Eigen::Vector3d point_m;  ///< where the motion ends, in the robot's frame
  std::string why;          ///< in the planner's words
};

struct ReachCheck {
  std::size_t points{0};  ///< that were asked for: the wait pose, each grasp, each approach
  std::vector<RefusedPoint> refused;
};

/// Plans what the worker of the robot commands; the arm begins with all joints at 0. Nine spots stand for an area: its corners and the
/// middles of its edges, where a piece stands on it whole, and its middle. A robot that runs elsewhere plans itself, from where it
/// stands, a free motion to each point. Throws client::Failure where the profile cannot be read, or the robot does not reply or is no
/// Arm.
[[nodiscard]] ReachCheck check_reach(const cell::CellConfig& cell, const cell::CellRobot& robot);

/// Prints the check of each robot. Throws client::Failure, kRefused, where a point is out of reach.
void cell_check(const cell::CellOptions& options);

}  // namespace corbot::cli
