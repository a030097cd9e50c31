// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planner/arc.h"
#include "soak/checks.h"
#include "soak/signature.h"

namespace corbot::soak {
namespace {

using Point = std::array<double, 3>;

/// The planner takes a path whose first point misses the arm's joints by half a microradian; the rest is the
/// inverse's rounding next to a stretched arm. See the property tests.
constexpr double kOnPath_m = 1e-6;
/// No motion runs its path backwards, except by rounding.
constexpr double kBackwards_m = 1e-8;
constexpr double kBackwards_deg = 4.0 * kAngleDigit_deg;
constexpr double kNear_deg = 0.2 * kStep_deg;
constexpr double kNear_m = 0.2 * kStep_m;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double norm(const Point& a) { return std::sqrt(dot(a, a)); }

Point point_of(const Call& call, std::size_t number) {
  return {call.where[3 * number], call.where[3 * number + 1], call.where[3 * number + 2]};
}
bool is_near(const Point& a, const Point& b) {
  return std::abs(a[0] - b[0]) <= kNear_m && std::abs(a[1] - b[1]) <= kNear_m &&
         std::abs(a[2] - b[2]) <= kNear_m;
}

/// A point's position along a path, and its distance from the path.
struct Place {
  double along_m;
  double off_m;
};

Place on_line(const Point& from_m, const Point& to_m, const Point& p) {
  const Point way = minus(to_m, from_m);
  const double length_m = norm(way);
  const Point rest = minus(p, from_m);
  const double along_m = length_m > 0.0 ? std::clamp(dot(rest, way) / length_m, 0.0, length_m) : 0.0;
  const double part = length_m > 0.0 ? along_m / length_m : 0.0;
  return {along_m, norm({rest[0] - part * way[0], rest[1] - part * way[1], rest[2] - part * way[2]})};
}

Place on_arc(const ArcMotion& arc, const Point& p) {
  const Point r = minus(p, arc.centre_m);
  const double x = dot(r, arc.u);
  const double y = dot(r, arc.v);
  double angle = std::atan2(y, x);
  // An angle a little before the start is no whole turn.
  if (angle < -0.5 * kOnPath_m / arc.radius_m) angle += 2.0 * M_PI;
  angle = std::clamp(angle, 0.0, arc.angle_rad);
  const Point at{arc.centre_m[0] + arc.radius_m * (std::cos(angle) * arc.u[0] + std::sin(angle) * arc.v[0]),
                 arc.centre_m[1] + arc.radius_m * (std::cos(angle) * arc.u[1] + std::sin(angle) * arc.v[1]),
                 arc.centre_m[2] + arc.radius_m * (std::cos(angle) * arc.u[2] + std::sin(angle) * arc.v[2])};
  return {angle * arc.radius_m, norm(minus(p, at))};
}

template <class OnPath>
std::string follow(const Motion& motion, OnPath&& on_path) {
  double along_m = 0.0;
  for (std::size_t i = 0; i < motion.tcp_m.size(); ++i) {
    const Place place = on_path(motion.tcp_m[i]);
    if (place.off_m > kOnPath_m)
      return fmt::format("set-point {} of {} is {:.3g} m off its path", i, motion.tcp_m.size(), place.off_m);
    if (place.along_m < along_m - kBackwards_m)
      return fmt::format("set-point {} of {} goes back by {:.3g} m on its path", i, motion.tcp_m.size(),
                         along_m - place.along_m);
    along_m = std::max(along_m, place.along_m);
  }
  return "";
}

std::string joint_path_fault(const Motion& motion, const Call& call) {
  const bool drives = call.operation.ends_with("Drive");
  for (std::size_t i = 0; i < 4; ++i) {
    const double target_deg =
        drives ? motion.start_deg[i] + (i == static_cast<std::size_t>(call.where[0]) ? call.where[1] : 0.0)
               : call.where[i];
    const double way_deg = target_deg - motion.start_deg[i];
    if (way_deg <= kNear_deg && motion.peaks.up_deg[i] > kBackwards_deg)
      return fmt::format("joint {} moves up by {:.3g} degrees in a cycle and was to go by {:.9f}", i,
                         motion.peaks.up_deg[i], way_deg);
    if (way_deg >= -kNear_deg && motion.peaks.down_deg[i] > kBackwards_deg)
      return fmt::format("joint {} moves down by {:.3g} degrees in a cycle and was to go by {:.9f}", i,
                         motion.peaks.down_deg[i], way_deg);
  }
  return "";
}

}  // namespace

bool is_line_to_arc(const Motion& motion, const Call& call) {
  if (!call.is_arc()) return false;
  if (call.ticket != 0) return motion.id + 1 == call.ticket;
  return is_near(motion.end_tcp_m, point_of(call, 0));
}

bool ends_as(const Motion& motion, const Call& call) {
  if (call.is_line()) return is_near(motion.end_tcp_m, point_of(call, 0));
  if (call.is_arc())
    return is_near(motion.end_tcp_m, point_of(call, 0)) || is_near(motion.end_tcp_m, point_of(call, 2));
  for (std::size_t i = 0; i < 4; ++i) {
    const bool drives = call.operation.ends_with("Drive");
    const double by_deg = static_cast<double>(i) == call.where[0] ? call.where[1] : 0.0;
    const double end_deg = drives ? motion.start_deg[i] + by_deg : call.where[i];
    if (std::abs(motion.end_deg[i] - end_deg) > kNear_deg) return false;
  }
  return true;
}

std::string path_fault(const Motion& motion, const Call& call) {
  if (!motion.knows_start) return "";
  if (call.is_line() || is_line_to_arc(motion, call)) {
    const Point to_m = point_of(call, 0);
    return follow(motion, [&](const Point& p) { return on_line(motion.start_tcp_m, to_m, p); });
  }
  if (call.is_arc()) {
    const auto arc = arc_through(point_of(call, 0), point_of(call, 1), point_of(call, 2));
    if (!std::holds_alternative<ArcMotion>(arc)) return "runs an arc through points that define none";
    return follow(motion, [&](const Point& p) { return on_arc(std::get<ArcMotion>(arc), p); });
  }
  return joint_path_fault(motion, call);
}

}  // namespace corbot::soak
