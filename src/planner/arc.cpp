// SPDX-License-Identifier: Apache-2.0
#include "planner/arc.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "corbot/motion/bounds.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

std::optional<PlanRefusal> check_apart(const char* first, const char* second, double distance_m) {
  if (distance_m > kCoincident_m) return std::nullopt;
  return bad_parameter(second, Quantity::kLength, distance_m, kCoincident_m, kFarthestCoordinate_m,
                       fmt::format("{} and {} are {:.6g} m apart, and a circle needs more than {:g} m: "
                                   "give three points that lie apart",
                                   first, second, distance_m, kCoincident_m));
}

}  // namespace

std::variant<ArcMotion, PlanRefusal> arc_through(const std::array<double, 3>& p1_m,
                                                 const std::array<double, 3>& p2_m,
                                                 const std::array<double, 3>& p3_m) {
  using Eigen::Vector3d;
  const Vector3d p1(p1_m.data());
  const Vector3d a = Vector3d(p2_m.data()) - p1;
  const Vector3d b = Vector3d(p3_m.data()) - p1;
  if (auto refusal = check_apart("P1", "P2", a.norm())) return *refusal;
  if (auto refusal = check_apart("P1", "P3", b.norm())) return *refusal;
  if (auto refusal = check_apart("P2", "P3", (b - a).norm())) return *refusal;
  const double longest_m = std::max({a.norm(), b.norm(), (b - a).norm()});
  const Vector3d normal = a.cross(b);
  const double flatness = normal.norm() / (longest_m * longest_m);
  if (!(flatness > kCollinear)) {
    return bad_parameter(
        "P2", Quantity::kNumber, flatness, kCollinear, 1.0,
        fmt::format("P1, P2 and P3 lie on a line (flatness {:.3g}, least {:.3g}): give a P2 beside that line",
                    flatness, kCollinear));
  }
  const Vector3d to_centre =
      (normal.cross(a) * b.squaredNorm() + b.cross(normal) * a.squaredNorm()) / (2.0 * normal.squaredNorm());
  const double radius_m = to_centre.norm();
  const Vector3d u = -to_centre / radius_m;
  const Vector3d v = normal.normalized().cross(u).normalized();

  ArcMotion arc{};
  Vector3d::Map(arc.centre_m.data()) = p1 + to_centre;
  Vector3d::Map(arc.u.data()) = u;
  Vector3d::Map(arc.v.data()) = v;
  arc.radius_m = radius_m;
  // The angle is computed relative to p1, not to the centre. On a flat arc the centre is far away and would
  // cost digits.
  const double angle = std::atan2(b.dot(v), radius_m + b.dot(u));
  arc.angle_rad = angle > 0.0 ? angle : angle + 2.0 * std::numbers::pi;
  return arc;
}

}  // namespace corbot
