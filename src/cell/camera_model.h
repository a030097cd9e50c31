// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Geometry>

namespace corbot::cell {

/// A calibrated camera: the pinhole with the distortion k1 k2 p1 p2 k3 of Brown and Conrady, as OpenCV has it
/// (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html). Camera frame: x right, y down in the picture, z ahead.
/// Pixels: (0, 0) is the middle of the upper left one.
struct CameraModel {
  std::array<int, 2> size_px{1280, 720};
  Eigen::Vector2d focal_px{1130, 1130};
  Eigen::Vector2d centre_px{639.5, 359.5};
  std::array<double, 5> distortion{};
  Eigen::Vector3d position_m{0, 0, 1};  ///< world
  Eigen::Quaterniond world_T_camera{0, 1, 0, 0};

  /// Where a point of the world, metres, is in the picture; nothing where it is not ahead of the camera.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& world) const;
  /// The point of the plane z = `z_m` that is seen at a pixel; nothing where the ray does not meet the plane ahead.
  [[nodiscard]] std::optional<Eigen::Vector3d> on_plane(const Eigen::Vector2d& pixel, double z_m) const;
};

}  // namespace corbot::cell
