// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Geometry>

namespace corbot::cell {

/// A calibrated camera: OpenCV's pinhole model with the Brown-Conrady distortion k1 k2 p1 p2 k3
/// (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html). Camera frame: x right, y down in the picture, z ahead.
/// Pixel (0, 0) is the middle of the upper left pixel.
struct CameraModel {
  std::array<int, 2> size_px{1280, 720};
  Eigen::Vector2d focal_px{1130, 1130};
  Eigen::Vector2d centre_px{639.5, 359.5};
  std::array<double, 5> distortion{};
  Eigen::Vector3d position_m{0, 0, 1};  ///< world
  Eigen::Quaterniond world_T_camera{0, 1, 0, 0};

  /// Projects a point of the world, in metres, to a pixel. Returns nothing for a point behind the camera.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& world) const;
  /// Returns the plane z = `z_m`'s point at a pixel, or nothing if the plane is not ahead on the pixel's ray.
  [[nodiscard]] std::optional<Eigen::Vector3d> on_plane(const Eigen::Vector2d& pixel, double z_m) const;
};

}  // namespace corbot::cell
