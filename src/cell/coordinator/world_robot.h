// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>
#include <string>

#include "cell/cell_config.h"
#include "cell/coordinator/ports.h"

namespace corbot::cell {

/// A point for the tool, world, metres, and the key of cell.toml that decides where it is.
struct ToolGoal {
  Eigen::Vector3d point{};
  std::string key{};

  [[nodiscard]] std::string name() const;  ///< "place[2]" or "robot[0].wait_m"
};

/// "(0.081, 0.243, 0.000) m"
[[nodiscard]] std::string describe(const Eigen::Vector3d& point);

/// A robot that takes points of the world. Commands throw WorkEnded once a stop is requested; PointRefused
/// where the robot does not reach the point; MotionFault at any other fault. Both texts have the point in both
/// frames and the place; that of PointRefused also has the key.
class WorldRobot {
 public:
  /// All must outlive it.
  WorldRobot(const CellRobot& robot, RobotPort& port, std::stop_token stop);

  void speed(const ToolGoal& at);  ///< that of the robot's configuration
  void open(const ToolGoal& at);
  void close(const ToolGoal& at);
  void settle(const ToolGoal& at);  ///< stands still before the gripper moves
  /// Free motion to the point, or to the height of approach over it.
  void move(const ToolGoal& goal);
  void move_above(const ToolGoal& goal);
  /// Straight lines between that height and the point, at the speed of approach.
  void descend(const ToolGoal& goal);
  void ascend(const ToolGoal& goal);
  /// A straight line at the speed of approach, up to that height of the world.
  void rise(const Eigen::Vector3d& tool, double height_m, const ToolGoal& to);
  /// Where the tool is at rest.
  [[nodiscard]] Eigen::Vector3d rest_position();
  /// Whether the tool is at rest within `tolerance_m` of the point.
  [[nodiscard]] bool is_at(const ToolGoal& goal, double tolerance_m);

 private:
  template <class F>
  void command(const char* where, const ToolGoal& goal, F&& f);

  const CellRobot& robot_;
  RobotPort& port_;
  const std::stop_token stop_;
};

}  // namespace corbot::cell
