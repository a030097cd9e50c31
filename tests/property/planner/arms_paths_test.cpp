// SPDX-License-Identifier: Apache-2.0
// Runs random lines, arcs and motions to a point of every family's arms at 1 kHz, as the real-time task runs
// them. The task's gate accepts each. The tool stays on its path with its orientation, within every limit of
// joints and tool, and arrives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "joint_ticks.h"
#include "path_ticks.h"
#include "planner/planner.h"
#include "published_arm.h"
#include "support/cases.h"
#include "support/gate.h"

namespace corbot::property_arms_paths_test {
namespace {

using test::check_ticks;
using test::gate;
using test::Point;

/// The shortest arm there is.
test::ArmVectors turntable() {
  test::ArmVectors vectors;
  vectors.table.count = 1;
  vectors.table.rows[0] = {JointKind::kRotary, 0.0, 0.1, 0.2, 0.0};
  vectors.lower_q[0] = -3.0;
  vectors.upper_q[0] = 3.0;
  return vectors;
}

ArmModel model(const std::string& name) {
  return name == "turntable" ? test::nominal_arm(turntable()) : test::published_arm(name);
}

struct Random {
  std::mt19937_64 engine;
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  Joints joints(const ArmModel& arm) {
    Joints q{};
    for (std::size_t i = 0; i < arm.dof; ++i) q[i] = in(arm.joints[i].lower_q, arm.joints[i].upper_q);
    return q;
  }
  Quaternion turned(const Quaternion& q, double most_rad) {
    const Vector3 axis{in(-1, 1), in(-1, 1), in(-1, 1)};
    return about((1.0 / norm(axis)) * axis, in(-most_rad, most_rad)) * q;
  }
};

class Joint : public testing::TestWithParam<const char*> {
 protected:
  ArmModel arm_ = model(GetParam());
  Random random_{std::mt19937_64(test::seed() + 3)};
};

class Paths : public Joint {
 protected:
  /// A place, and how it is to be approached, for case `i`.
  PlanSettings settings(int i, const Quaternion& present) {
    PlanSettings s;
    if (i % 3 == 0) s.speed_ratio = random_.in(0.05, 1.0);
    if (i % 5 == 0) s.joint_speed_ratio[static_cast<std::size_t>(i / 5) % arm_.dof] = random_.in(0.05, 1.0);
    if (i % 2 == 0 && arm_.kinematics.follows() == Follows::kFull) {
      s.tool_orientation = random_.turned(present, i % 4 == 0 ? 3.1 : 0.5);
    }
    if (i % 2 == 0 && arm_.kinematics.follows() == Follows::kPitchAndRoll)
      s.tool_pitch_rad = random_.in(-1.0, 1.0);
    if (arm_.kinematics.follows() == Follows::kPitch) {
      s.tool_pitch_rad = present_pitch_ + (i % 2 == 0 ? random_.in(-0.5, 0.5) : 0.0);
    }
    return s;
  }
  Point near(const Point& p, double size) {
    return {p[0] + random_.in(-size, size), p[1] + random_.in(-size, size), p[2] + random_.in(-size, size)};
  }
  PlanStart start() {
    const PlanStart at{random_.joints(arm_), 0.0};
    present_pitch_ = tool_pose(arm_.kinematics, at.position_q).pitch_rad;
    return at;
  }
  void expect_end(const Command& command, const Point& target_m, const PlanSettings& s, const Pose& before) {
    const Pose end = arm_.kinematics.forward(command.end_q);
    EXPECT_LT(test::distance(end.position_m, target_m), 1e-9);
    if (arm_.kinematics.follows() == Follows::kFull) {
      EXPECT_LT(angle_between(end.orientation, s.tool_orientation.value_or(before.orientation)), 1e-8);
    }
    if (s.tool_pitch_rad &&
        points_along_roll_axis()) {  // above the horizontal, however the table's own axes point
      EXPECT_NEAR(to_matrix(end.orientation)[2][0], std::sin(*s.tool_pitch_rad), 1e-9);
    }
  }

  /// Whether a roll leaves the tool's x axis, whose pitch is asked for, where it is; the so101's is square to
  /// it.
  bool points_along_roll_axis() {
    if (arm_.kinematics.follows() == Follows::kPitch) return true;
    const Vector3 before = rotate(arm_.kinematics.forward({}).orientation, {1.0, 0.0, 0.0});
    return norm(rotate(arm_.kinematics.forward({0.0, 0.0, 0.0, 0.0, 1.0}).orientation, {1.0, 0.0, 0.0}) -
                before) < 1e-9;
  }

  double present_pitch_{};
};

TEST_P(Paths, LinesStayStraightWithinEveryLimitAndArrive) {
  int planned = 0;
  test::Tightest tightest;
  const int cases = test::cases(600);
  for (int i = 0; i < cases; ++i) {
    const PlanStart from = start();
    const Pose here = arm_.kinematics.forward(from.position_q);
    const Point target = near(here.position_m, i % 8 < 4 ? 0.15 : 0.02);
    const PlanSettings s = settings(i, here.orientation);
    const PlanResult result = Planner(arm_).move_s(from, s, target, 0.0);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm_, s, command, command.line, test::rate_of(result), &tightest))
        << "case " << i;
    ASSERT_EQ(gate(arm_, command, test::rate_of(result)), Verdict::kDone) << "case " << i;
    expect_end(command, target, s, here);
    ++planned;
  }
  std::cout << planned << " of " << cases << " lines planned; joint speed used up to "
            << 100.0 * tightest.joint_speed << " %\n";
  EXPECT_GT(planned, cases / 20);
}

TEST_P(Paths, ArcsStayRoundWithinEveryLimitAndArrive) {
  int planned = 0;
  test::Tightest tightest;
  const int cases = test::cases(600);
  for (int i = 0; i < cases; ++i) {
    const PlanStart from = start();
    const Pose here = arm_.kinematics.forward(from.position_q);
    const double size = i % 8 < 4 ? 0.08 : 0.01;
    const Point p2 = near(here.position_m, size), p3 = near(here.position_m, size);
    const PlanSettings s = settings(i, here.orientation);
    const PlanResult result = Planner(arm_).move_c(from, s, here.position_m, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const auto& commands = std::get<std::vector<Command>>(result);
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const PlannedRate rate = test::rate_of(result, k);
      if (commands[k].kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(check_ticks(arm_, s, commands[k], commands[k].arc, rate, &tightest))
            << "case " << i;
      }
      ASSERT_EQ(gate(arm_, commands[k], rate), Verdict::kDone) << "case " << i;
    }
    expect_end(commands.back(), p3, s, here);
    ++planned;
  }
  std::cout << planned << " of " << cases << " arcs planned; joint speed used up to "
            << 100.0 * tightest.joint_speed << " %\n";
  EXPECT_GT(planned, cases / 20);
}

TEST_P(Paths, MotionsToAPointArriveWithTheOrientation) {
  const int cases = test::cases(2000);
  for (int i = 0; i < cases; ++i) {
    const PlanStart from = start();
    const Joints goal_q = random_.joints(arm_);
    const Pose goal = arm_.kinematics.forward(goal_q);
    PlanSettings s;
    s.tool_orientation = goal.orientation;  // which this arm can take there
    const PlanResult result = Planner(arm_).move(from, s, goal.position_m, 0.0);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result))
        << "case " << i << ": " << std::get<PlanRefusal>(result).text;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm_, s, command)) << "case " << i;
    ASSERT_EQ(gate(arm_, command), Verdict::kDone) << "case " << i;
    const Pose end = arm_.kinematics.forward(command.end_q);
    ASSERT_LT(test::distance(end.position_m, goal.position_m), 1e-9) << "case " << i;
    ASSERT_LT(angle_between(end.orientation, goal.orientation), 2e-6) << "case " << i;
  }
}

/// One joint after the other or all at once, by turns within a time of the caller's; also arms without lines
/// and arcs.
TEST_P(Joint, MotionsKeepTheLimitsAndArrive) {
  const int cases = test::cases(500);
  for (int i = 0; i < cases; ++i) {
    const PlanStart from{random_.joints(arm_), 0.0};
    PlanSettings s;
    if (i % 3 == 0) s.speed_ratio = random_.in(0.05, 1.0);
    if (i % 5 == 0) s.joint_speed_ratio[static_cast<std::size_t>(i / 5) % arm_.dof] = random_.in(0.05, 1.0);
    const double t_s = i % 4 == 0 ? random_.in(0.0, 10.0) : 0.0;
    const Joints goal = random_.joints(arm_);
    const PlanResult result = Planner(arm_).move_joints(from, s, goal, t_s);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result))
        << "case " << i << ": " << std::get<PlanRefusal>(result).text;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm_, s, command)) << "case " << i;
    ASSERT_EQ(gate(arm_, command), Verdict::kDone) << "case " << i;
    for (std::size_t k = 0; k < arm_.dof; ++k) ASSERT_NEAR(command.end_q[k], goal[k], 1e-14) << "case " << i;
    ASSERT_GE(command.duration_s, t_s) << "case " << i;

    const std::size_t joint = static_cast<std::size_t>(i) % arm_.dof;
    const double speed = random_.in(0.05, 0.99) * arm_.joints[joint].speed_q_s;
    const PlanResult one =
        Planner(arm_).drive(from, {}, static_cast<int>(joint), goal[joint] - from.position_q[joint], speed);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(one)) << "case " << i;
    PlanSettings at_speed;
    at_speed.speed_ratio = speed / arm_.joints[joint].speed_q_s;
    ASSERT_NO_FATAL_FAILURE(check_ticks(arm_, at_speed, std::get<std::vector<Command>>(one).front()))
        << "case " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Paths,
                         testing::Values("al5d", "al5d_wr", "omx", "px100", "so101", "puma560", "irb2400",
                                         "ur5e", "scara_cobra600", "scara_gx4", "cartesian_ppp",
                                         "cartesian_pppr", "cylindrical_rpp", "cylindrical_rppr", "polar_rrp",
                                         "stanford"),
                         [](const auto& arm) { return std::string(arm.param); });

const auto kName = [](const auto& arm) { return std::string(arm.param); };

INSTANTIATE_TEST_SUITE_P(Arms, Joint,
                         testing::Values("al5d", "al5d_wr", "puma560", "scara_gx4", "cartesian_pppr",
                                         "cylindrical_rpp", "polar_rrp", "stanford", "xarm6", "turntable"),
                         kName);

}  // namespace
}  // namespace corbot::property_arms_paths_test
