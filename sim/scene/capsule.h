// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace corbot::sim {

/// A body of an arm: all points within a radius of a line segment. Metres, world.
struct Capsule {
  Eigen::Vector3d from_m{};
  Eigen::Vector3d to_m{};
  double radius_m{};
};

/// Returns the distance between the surfaces; negative if they overlap. Shortest distance of two segments: C.
/// Ericson, Real-Time Collision Detection, 5.1.9.
[[nodiscard]] inline double distance_m(const Capsule& a, const Capsule& b) {
  const Eigen::Vector3d u = a.to_m - a.from_m;
  const Eigen::Vector3d v = b.to_m - b.from_m;
  const Eigen::Vector3d w = a.from_m - b.from_m;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double uw = u.dot(w);
  const double vw = v.dot(w);
  constexpr double kPoint = 1e-18;
  double s = 0;
  double t = 0;
  if (uu <= kPoint) {
    t = vv <= kPoint ? 0 : std::clamp(vw / vv, 0.0, 1.0);
  } else if (vv <= kPoint) {
    s = std::clamp(-uw / uu, 0.0, 1.0);
  } else {
    const double denominator = uu * vv - uv * uv;
    s = denominator > kPoint ? std::clamp((uv * vw - uw * vv) / denominator, 0.0, 1.0) : 0;
    t = (uv * s + vw) / vv;
    if (t < 0 || t > 1) {
      t = std::clamp(t, 0.0, 1.0);
      s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
    }
  }
  return (w + s * u - t * v).norm() - a.radius_m - b.radius_m;
}

}  // namespace corbot::sim
