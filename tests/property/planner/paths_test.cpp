// SPDX-License-Identifier: Apache-2.0
// Random lines and arcs, run at 1 kHz as the real-time task runs them: reach, deviation, range and speed of
// every joint at every tick, the path's own limits, and the end.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "corbot/motion/bounds.h"
#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "planner/planner.h"
#include "seed.h"
#include "test_arm.h"

namespace corbot {
namespace {

using test::deg;
using Point = std::array<double, 3>;

/// Distance from the straight line or from the circle that was asked for.
double deviation(const LineMotion& line, const Point& p) {
  const double length = length_m(line);
  if (length < 1e-12) return test::distance(line.from_m, p);
  std::array<double, 3> d{}, e{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = (line.to_m[i] - line.from_m[i]) / length;
    e[i] = p[i] - line.from_m[i];
  }
  return std::hypot(d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]);
}
double deviation(const ArcMotion& arc, const Point& p) {
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

template <class Motion>
void check_ticks(const ArmModel& arm, const PlanSettings& settings, const Command& command,
                 const Motion& motion, Tightest* tightest) {
  constexpr double kSlack = 1.0 + 1e-6;
  ASSERT_TRUE(is_well_formed(motion.law));
  const double length = length_m(motion);
  const double duration_s = command.duration_s;
  // Motions that creep past a singularity last up to an hour; 60,000 ticks are enough.
  const double tick_s = std::max(1e-3, duration_s / 60'000.0);
  const int ticks = static_cast<int>(std::ceil(duration_s / tick_s));
  Joints last = command.start_q;
  std::array<Point, 4> track{};
  track.fill(test::tcp_of(arm, command.start_q));
  for (int k = 0; k <= ticks; ++k) {
    const LawState s = evaluate(motion.law, k * tick_s);
    const PathPoint wanted = point_at(motion, s.position);
    const IkSolution ik = joints_at(arm, wanted, motion.solution, command.start_q);
    ASSERT_EQ(ik.status, IkStatus::kOk) << "tick " << k << " of " << ticks;
    const Point tcp = test::tcp_of(arm, ik.joints_q);
    ASSERT_LT(deviation(motion, tcp), 1e-6) << "tick " << k;
    for (std::size_t i = 0; i < 4; ++i) {
      const double q = ik.joints_q[i];
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
    const LawPeaks peak = peaks(motion.law);
    const double turn = std::abs(motion.to_pitch_rad - motion.from_pitch_rad);
    ASSERT_LE(peak.velocity * turn, arm.path.rotation_speed_rad_s * settings.speed_ratio * kSlack);
    ASSERT_LE(peak.acceleration * turn, arm.path.rotation_acceleration_rad_s2 * kSlack);
    ASSERT_LE(peak.jerk * turn, arm.path.rotation_jerk_rad_s3 * kSlack);
    track = {tcp, track[0], track[1], track[2]};
    last = ik.joints_q;
  }
  for (std::size_t i = 0; i < 4; ++i) ASSERT_NEAR(last[i], command.end_q[i], 1e-9);
}

struct Random {
  std::mt19937_64 engine;
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  Joints joints(const ArmModel& arm) {
    Joints q{};
    for (std::size_t i = 0; i < 4; ++i) q[i] = in(arm.joints[i].lower_q, arm.joints[i].upper_q);
    return q;
  }
};

PlanSettings random_settings(Random& random, int i, double pitch) {
  PlanSettings settings;
  settings.tool_pitch_rad = pitch;
  if (i % 3 == 0) settings.speed_ratio = random.in(0.05, 1.0);
  if (i % 5 == 0) settings.joint_speed_ratio[static_cast<std::size_t>(i / 5 % 4)] = random.in(0.05, 1.0);
  return settings;
}

TEST(Lines, StayStraightWithinEveryLimitAndArrive) {
  Random random{std::mt19937_64(test::seed())};
  Tightest tightest;
  int planned = 0, from_ready = 0;
  const int cases = test::cases(6000);
  for (int i = 0; i < cases; ++i) {
    ArmModel arm = i % 2 == 0 ? test::lynx5() : test::wide_arm();
    if (i % 7 == 0) arm.path.speed_m_s = 2.0;  // so that the joints, not the path, are what limits
    const bool at_ready = i % 4 == 0;
    const PlanStart start{at_ready ? Joints{} : random.joints(arm), 0.0};
    const ToolPose here = tool_pose(arm.kinematics, start.position_q);
    Point target{};
    const double near = i % 8 < 4 ? 0.15 : 0.02;
    for (std::size_t k = 0; k < 3; ++k) target[k] = here.position_m[k] + random.in(-near, near);
    if (i % 16 == 1) target = test::tcp_of(arm, random.joints(arm));
    const PlanSettings settings = random_settings(random, i,
                                                  i % 6 == 0   ? random.in(-1.5, 1.5)
                                                  : i % 6 == 1 ? 0.0
                                                               : here.pitch_rad);
    const double t_s = i % 9 == 0 ? 5.0 : 0.0;
    const PlanResult result = Planner(arm).move_s(start, settings, target, t_s);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_EQ(command.kind, MotionKind::kLine);
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm, settings, command, command.line, &tightest))
        << "case " << i << (at_ready ? " from Ready" : "");
    ASSERT_LT(test::distance(test::tcp_of(arm, command.end_q), target), 1e-9);
    if (t_s > 0.0) {
      ASSERT_GE(command.duration_s, t_s);
    }
    ++planned;
    from_ready += at_ready ? 1 : 0;
  }
  std::cout << planned << " of " << cases << " lines planned, " << from_ready
            << " from Ready; joint speed used up to " << 100.0 * tightest.joint_speed << " %\n";
  EXPECT_GT(planned, cases / 5);
  EXPECT_GT(from_ready, cases / 50);
  EXPECT_GT(tightest.joint_speed, 0.95) << "the speed limits of the joints were never near";
}

TEST(Arcs, StayRoundWithinEveryLimitAndArrive) {
  Random random{std::mt19937_64(test::seed() + 1)};
  Tightest tightest;
  int planned = 0, direct = 0;
  const int cases = test::cases(6000);
  for (int i = 0; i < cases; ++i) {
    ArmModel arm = i % 2 == 0 ? test::lynx5() : test::wide_arm();
    if (i % 7 == 0) arm.path.speed_m_s = 2.0;
    const PlanStart start{random.joints(arm), 0.0};
    const ToolPose here = tool_pose(arm.kinematics, start.position_q);
    const double size = i % 8 < 4 ? 0.08 : 0.01;
    std::array<Point, 3> p{};
    for (Point& point : p) {
      for (std::size_t k = 0; k < 3; ++k) point[k] = here.position_m[k] + random.in(-size, size);
    }
    if (i % 3 != 0) p[0] = here.position_m;
    const PlanSettings settings =
        random_settings(random, i, i % 6 == 0 ? random.in(-1.5, 1.5) : here.pitch_rad);
    const PlanResult result = Planner(arm).move_c(start, settings, p[0], p[1], p[2]);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const auto& commands = std::get<std::vector<Command>>(result);
    ASSERT_EQ(commands.size(), i % 3 != 0 ? 1u : 2u);
    if (commands.size() == 2) {
      ASSERT_NO_FATAL_FAILURE(check_ticks(arm, settings, commands[0], commands[0].line, &tightest))
          << "case " << i;
      ASSERT_EQ(commands[0].end_q, commands[1].start_q);
    } else {
      ++direct;
    }
    const Command& command = commands.back();
    ASSERT_EQ(command.kind, MotionKind::kArc);
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm, settings, command, command.arc, &tightest)) << "case " << i;
    ASSERT_LT(test::distance(test::tcp_of(arm, command.end_q), p[2]), 1e-9);
    ASSERT_LT(deviation(command.arc, p[1]), 1e-9) << "P2 lies on the arc";
    ++planned;
  }
  std::cout << planned << " of " << cases << " arcs planned, " << direct
            << " from P1; joint speed used up to " << 100.0 * tightest.joint_speed << " %\n";
  EXPECT_GT(planned, cases / 8);
  EXPECT_GT(tightest.joint_speed, 0.95);
}

}  // namespace
}  // namespace corbot
