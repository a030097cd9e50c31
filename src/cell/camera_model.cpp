// SPDX-License-Identifier: Apache-2.0
#include "cell/camera_model.h"

namespace corbot::cell {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Distorts normalised coordinates as the lens does.
Vector2d distort(const Vector2d& p, const std::array<double, 5>& k) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

Eigen::Matrix2d distortion_slope(const Vector2d& p, const std::array<double, 5>& k) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = 2 * (k[0] + r2 * (2 * k[1] + 3 * r2 * k[4]));  // derivative of `radial` by r2 / 2
  Eigen::Matrix2d j;
  j << radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x, slope * x * y + 2 * k[2] * x + 2 * k[3] * y,
      slope * x * y + 2 * k[2] * x + 2 * k[3] * y, radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
  return j;
}

/// Inverts distort() by Newton steps, which converge if the distortion is monotonic within the picture.
Vector2d undistort(const Vector2d& seen, const std::array<double, 5>& k) {
  Vector2d p = seen;
  for (int i = 0; i < 20; ++i) {
    const Vector2d off = distort(p, k) - seen;
    if (off.squaredNorm() < 1e-24) break;
    p -= distortion_slope(p, k).inverse() * off;
  }
  return p;
}

}  // namespace

std::optional<Vector2d> CameraModel::project(const Vector3d& world) const {
  const Vector3d p = world_T_camera.conjugate() * (world - position_m);
  if (p.z() <= 1e-6) return std::nullopt;
  return focal_px.cwiseProduct(distort(p.head<2>() / p.z(), distortion)) + centre_px;
}

std::optional<Vector3d> CameraModel::on_plane(const Vector2d& pixel, double z_m) const {
  const Vector2d p = undistort((pixel - centre_px).cwiseQuotient(focal_px), distortion);
  const Vector3d ray = world_T_camera * Vector3d(p.x(), p.y(), 1);
  const double along = (z_m - position_m.z()) / ray.z();
  if (!(along > 0)) return std::nullopt;
  return position_m + along * ray;
}

}  // namespace corbot::cell
