// SPDX-License-Identifier: Apache-2.0
// Runs random lines and arcs at 1 kHz, as the real-time task runs them. It checks reach, deviation, range and
// speed of every joint at every tick, the path's own limits, and the end.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "path_ticks.h"
#include "planner/planner.h"
#include "support/cases.h"
#include "test_arm.h"

namespace corbot::property_paths_test {
namespace {

using test::check_ticks;
using test::deg;
using test::deviation;
using test::Tightest;
using Point = std::array<double, 3>;

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
    ASSERT_NO_FATAL_FAILURE(
        check_ticks(arm, settings, command, command.line, test::rate_of(result), &tightest))
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
      ASSERT_NO_FATAL_FAILURE(
          check_ticks(arm, settings, commands[0], commands[0].line, test::rate_of(result), &tightest))
          << "case " << i;
      ASSERT_EQ(commands[0].end_q, commands[1].start_q);
    } else {
      ++direct;
    }
    const Command& command = commands.back();
    ASSERT_EQ(command.kind, MotionKind::kArc);
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm, settings, command, command.arc,
                                        test::rate_of(result, commands.size() - 1), &tightest))
        << "case " << i;
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
}  // namespace corbot::property_paths_test
