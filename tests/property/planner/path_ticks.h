// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "corbot/motion/bounds.h"
#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "planner/plan/plan.h"
#include "test_arm.h"

// A line or an arc run at 1 kHz as the real-time task runs it, looked at in every tick.

namespace corbot::test {

using Point = std::array<double, 3>;

/// Distance from the straight line or from the circle that was asked for.
inline double deviation(const LineMotion& line, const Point& p) {
  const double length = length_m(line);
  if (length < 1e-12) return distance(line.from_m, p);
  std::array<double, 3> d{}, e{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = (line.to_m[i] - line.from_m[i]) / length;
    e[i] = p[i] - line.from_m[i];
  }
  return std::hypot(d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]);
}
inline double deviation(const ArcMotion& arc, const Point& p) {
  double along_u = 0.0, along_v = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    along_u += (p[i] - arc.centre_m[i]) * arc.u[i];
    along_v += (p[i] - arc.centre_m[i]) * arc.v[i];
  }
  std::array<double, 3> off{};
  for (std::size_t i = 0; i < 3; ++i)
    off[i] = p[i] - arc.centre_m[i] - along_u * arc.u[i] - along_v * arc.v[i];
  return std::hypot(std::hypot(along_u, along_v) - arc.radius_m, std::hypot(off[0], off[1], off[2]));
}

struct Tightest {
  double joint_speed{};  ///< greatest part of a joint's speed that was used
};

/// The state of a planned path at a time: joints and the part of the path that is done.
struct PathPlace {
  Joints q{};
  double s{};
};
inline PathPlace place_at(const Command& command, const PlannedRate& rate, double t_s) {
  if (rate.pieces.empty()) return {command.start_q, 0.0};
  const rate::RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
  const rate::State z = rate::state_at(rate.knots, law.at(t_s).lambda_s);
  PathPlace place{{}, z[rate::kPath]};
  std::copy_n(z.begin(), place.q.size(), place.q.begin());
  return place;
}
/// None of a command that is no path.
inline PlannedRate rate_of(const PlanResult& plan, std::size_t command = 0) {
  return command < plan.rates.size() ? plan.rates[command] : PlannedRate{};
}

template <class Motion>
void check_ticks(const ArmModel& arm, const PlanSettings& settings, const Command& command,
                 const Motion& motion, const PlannedRate& rate, Tightest* tightest) {
  constexpr double kSlack = 1.0 + 1e-6;
  const double length = length_m(motion);
  const double duration_s = command.duration_s;
  // Motions that creep past a singularity last up to an hour; 60,000 ticks are enough.
  const double tick_s = std::max(1e-3, duration_s / 60'000.0);
  const int ticks = static_cast<int>(std::ceil(duration_s / tick_s));
  Joints last = command.start_q;
  Quaternion before{};
  std::array<Point, 4> track{};
  track.fill(tcp_of(arm, command.start_q));
  for (int k = 0; k <= ticks; ++k) {
    const PathPlace place = place_at(command, rate, k * tick_s);
    const PathPoint wanted = point_at(motion, place.s);
    const Point tcp = tcp_of(arm, place.q);
    ASSERT_LT(deviation(motion, tcp), 1e-6) << "tick " << k;
    const Quaternion orientation = arm.kinematics.forward(place.q).orientation;
    if (arm.kinematics.follows() == Follows::kFull) {
      ASSERT_LT(angle_between(orientation, wanted.orientation), 1e-6) << "tick " << k;
    } else {
      const Angles angles = arm.kinematics.followed().at(place.q);
      for (std::size_t i = 0; i < arm.kinematics.followed().count; ++i) {
        ASSERT_LT(std::abs(wrap_angle(angles[i] - wanted.angles_rad[i])), 1e-6) << "tick " << k;
      }
    }
    if (arm.kinematics.follows() == Follows::kFull && k > 0) {
      ASSERT_LE(angle_between(orientation, before),
                arm.path.rotation_speed_rad_s * settings.speed_ratio * tick_s * kSlack + 1e-8);
    }
    before = orientation;
    for (std::size_t i = 0; i < arm.dof; ++i) {
      const double q = place.q[i];
      const double limit = arm.joints[i].speed_q_s * settings.joint_speed_ratio[i];
      ASSERT_GE(q, arm.joints[i].lower_q - kRangeTolerance_q) << "joint " << i << " tick " << k;
      ASSERT_LE(q, arm.joints[i].upper_q + kRangeTolerance_q) << "joint " << i << " tick " << k;
      // 1e-7 rad: what rounding does to a joint next to a singularity, within one tick.
      ASSERT_LE(std::abs(q - last[i]), limit * tick_s * kSlack + 1e-7)
          << "joint " << i << " tick " << k << " of " << ticks;
      tightest->joint_speed = std::max(tightest->joint_speed, std::abs(q - last[i]) / (limit * tick_s));
    }
    // The TCP's own limits, from difference quotients;
    // third differences carry a rounding of 1e-15 m / (1 ms)³.
    std::array<double, 3> v{}, a{}, j{};
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = (tcp[i] - track[0][i]) / tick_s;
      a[i] = (tcp[i] - 2.0 * track[0][i] + track[1][i]) / (tick_s * tick_s);
      j[i] = (tcp[i] - 3.0 * track[0][i] + 3.0 * track[1][i] - track[2][i]) / (tick_s * tick_s * tick_s);
    }
    if (length > 1e-9) {
      ASSERT_LE(std::hypot(v[0], v[1], v[2]), arm.path.speed_m_s * settings.speed_ratio * kSlack + 1e-9);
      ASSERT_LE(std::hypot(a[0], a[1], a[2]), arm.path.acceleration_m_s2 * kSlack + 1e-8) << "tick " << k;
      ASSERT_LE(std::hypot(j[0], j[1], j[2]), arm.path.jerk_m_s3 * kSlack + 1e-4) << "tick " << k;
    }
    track = {tcp, track[0], track[1], track[2]};
    last = place.q;
  }
  for (std::size_t i = 0; i < arm.dof; ++i) ASSERT_NEAR(last[i], command.end_q[i], 1e-9);
}

}  // namespace corbot::test
