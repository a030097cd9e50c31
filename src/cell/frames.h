// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>

namespace corbot::cell {

/// The frame of a place or robot, whose z is vertical: p_world = position + Rz(yaw) p_local.
struct UprightFrame {
  Eigen::Vector3d position_m{Eigen::Vector3d::Zero()};  ///< origin, world
  double yaw_rad{0};                                    ///< rotation about z

  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const {
    return position_m + Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * local;
  }
  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& world) const {
    return Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()) * (world - position_m);
  }
};

}  // namespace corbot::cell
