// SPDX-License-Identifier: Apache-2.0
// Random point-to-point motions, run at 1 kHz: range, speed, acceleration and jerk of every joint,
// and the end.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "joint_ticks.h"
#include "planner/planner.h"
#include "support/cases.h"
#include "test_arm.h"

namespace corbot::property_joint_motions_test {
namespace {

using test::deg;

Joints random_joints(const ArmModel& arm, std::mt19937_64& random) {
  Joints q{};
  for (std::size_t i = 0; i < arm.dof; ++i) {
    q[i] = std::uniform_real_distribution<double>(arm.joints[i].lower_q, arm.joints[i].upper_q)(random);
  }
  return q;
}

TEST(JointMotions, KeepTheLimitsAndArrive) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> ratio(0.05, 1.0);
  int moved = 0, refused = 0;
  const int cases = test::cases(3000);
  for (int i = 0; i < cases; ++i) {
    const ArmModel arm = i % 2 == 0 ? test::lynx5() : test::wide_arm();
    const Planner planner(arm);
    PlanSettings settings;
    if (i % 3 == 0) settings.speed_ratio = ratio(random);
    if (i % 5 == 0) settings.joint_speed_ratio[static_cast<std::size_t>(i / 5 % 4)] = ratio(random);
    const PlanStart start{random_joints(arm, random), 0.0};
    const Joints goal = random_joints(arm, random);
    const ToolPose pose = tool_pose(arm.kinematics, goal);
    settings.tool_pitch_rad = pose.pitch_rad;
    const double t_s = i % 4 == 0 ? 10.0 * ratio(random) : 0.0;
    const PlanResult result = planner.move(start, settings, pose.position_m, t_s);
    // The goal is reachable by construction, on at least one branch.
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result)) << std::get<PlanRefusal>(result).text;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(test::check_ticks(arm, settings, command)) << "case " << i;
    ASSERT_LT(test::distance(test::tcp_of(arm, command.end_q), pose.position_m), 1e-9) << "case " << i;
    ++moved;

    const PlanResult free = planner.move(start, settings, pose.position_m, 0.0);
    const double shortest_s = std::get<std::vector<Command>>(free).front().duration_s;
    ASSERT_EQ(command.duration_s, std::max(shortest_s, t_s));

    const PlanResult joints = planner.move_joints(start, settings, goal, t_s);
    ASSERT_NO_FATAL_FAILURE(test::check_ticks(arm, settings, std::get<std::vector<Command>>(joints).front()))
        << "case " << i;

    const PlanResult beyond = planner.move(start, settings, {0.5 + ratio(random), 0.1, 0.1}, 0.0);
    refused += std::holds_alternative<PlanRefusal>(beyond) ? 1 : 0;
  }
  EXPECT_EQ(moved, cases);
  EXPECT_EQ(refused, cases);
}

}  // namespace
}  // namespace corbot::property_joint_motions_test
