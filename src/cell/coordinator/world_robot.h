// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>
#include <string>

#include "cell/cell_config.h"
#include "cell/coordinator/ports.h"

namespace corbot::cell {

/// A point for the tool, world, in metres, and the key of cell.toml that determines the point.
struct ToolGoal {
  Eigen::Vector3d point{};
  std::string key{};

  [[nodiscard]] std::string name() const;  ///< "place[2]" or "robot[0].wait_m"
};

/// "(0.081, 0.243, 0.000) m"
[[nodiscard]] std::string describe(const Eigen::Vector3d& point);

/// A robot that accepts points in the world frame. Commands throw WorkEnded once a stop is requested,
/// PointRefused if the point is out of reach, and MotionFault at any other fault. The texts of both faults
/// name the place and the point in both frames. The text of PointRefused also names the key.
class WorldRobot {
 public:
  /// `robot` and `port` must outlive the instance.
  WorldRobot(const CellRobot& robot, RobotPort& port, std::stop_token stop);

  void speed(const ToolGoal& at);  ///< sets the configured speed
  void open(const ToolGoal& at);
  void close(const ToolGoal& at);
  void settle(const ToolGoal& at);  ///< waits at rest before the gripper moves
  /// Moves freely to the point, or to the approach height above it.
  void move(const ToolGoal& goal);
  void move_above(const ToolGoal& goal);
  /// Moves on the arc between two points over the table. Throws PointRefused also at every other refusal of
  /// the arc.
  void move_on_arc(const ToolGoal& from, const ToolGoal& to);
  /// Returns the approach height above the point.
  [[nodiscard]] ToolGoal above(const ToolGoal& goal) const;
  /// Moves on a straight line between the approach height and the point, at the approach speed.
  void descend(const ToolGoal& goal);
  void ascend(const ToolGoal& goal);
  /// Moves straight up to `height_m` in the world frame, at the approach speed.
  void rise(const Eigen::Vector3d& tool, double height_m, const ToolGoal& to);
  /// Waits for rest and returns the tool's position.
  [[nodiscard]] Eigen::Vector3d rest_position();
  /// Tells if the tool is at rest within `tolerance_m` of the point.
  [[nodiscard]] bool is_at(const ToolGoal& goal, double tolerance_m);

 private:
  template <class F>
  void command(const char* where, const ToolGoal& goal, F&& f);

  const CellRobot& robot_;
  RobotPort& port_;
  const std::stop_token stop_;
};

}  // namespace corbot::cell
