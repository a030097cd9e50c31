// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>

namespace corbot::cell {

/// A frame whose z is vertical, as places and robots have it: p_world = position + Rz(yaw) p_local.
struct UprightFrame {
  Eigen::Vector3d position_m{Eigen::Vector3d::Zero()};  ///< in the world
  double yaw_rad{0};                                    ///< about z

  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const {
    return position_m + Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * local;
  }
  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& world) const {
    return Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()) * (world - position_m);
  }
};

}  // namespace corbot::cell
