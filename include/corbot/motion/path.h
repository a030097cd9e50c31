// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "corbot/motion/command.h"

// Where a path is at parameter s in [0, 1]. Real-time safe.

namespace corbot {

/// TCP in the base frame, and tool pitch.
struct PathPoint {
  std::array<double, 3> position_m{};
  double pitch_rad{};
};

namespace detail {

/// Exact at s = 0, at s = 1 and wherever both ends are equal.
[[nodiscard]] inline double blend(double from, double to, double s) noexcept {
  return from == to ? from : from * (1.0 - s) + to * s;
}

}  // namespace detail

[[nodiscard]] inline PathPoint point_at(const LineMotion& line, double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  return {{detail::blend(line.from_m[0], line.to_m[0], s), detail::blend(line.from_m[1], line.to_m[1], s),
           detail::blend(line.from_m[2], line.to_m[2], s)},
          detail::blend(line.from_pitch_rad, line.to_pitch_rad, s)};
}

[[nodiscard]] inline PathPoint point_at(const ArcMotion& arc, double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  const double x = arc.radius_m * std::cos(s * arc.angle_rad);
  const double y = arc.radius_m * std::sin(s * arc.angle_rad);
  return {{arc.centre_m[0] + x * arc.u[0] + y * arc.v[0], arc.centre_m[1] + x * arc.u[1] + y * arc.v[1],
           arc.centre_m[2] + x * arc.u[2] + y * arc.v[2]},
          detail::blend(arc.from_pitch_rad, arc.to_pitch_rad, s)};
}

[[nodiscard]] inline double length_m(const LineMotion& line) noexcept {
  return std::hypot(line.to_m[0] - line.from_m[0], line.to_m[1] - line.from_m[1],
                    line.to_m[2] - line.from_m[2]);
}

[[nodiscard]] inline double length_m(const ArcMotion& arc) noexcept { return arc.radius_m * arc.angle_rad; }

}  // namespace corbot
