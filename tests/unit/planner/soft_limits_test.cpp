// SPDX-License-Identifier: Apache-2.0
// Motions keep the soft limits in place of the arm's ranges: targets, and every way there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "planner/planner.h"
#include "published_arm.h"
#include "support/gate.h"
#include "test_arm.h"

namespace corbot::soft_limits_test {
namespace {

using test::deg;
using test::lynx5;
using Kind = PlanRefusal::Kind;

const PlanStart kBent{{0.1, deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};

PlanSettings limited(int joint, double lower_deg, double upper_deg) {
  PlanSettings settings;
  settings.soft_limits.emplace();
  for (std::size_t i = 0; i < 4; ++i) {
    settings.soft_limits->lower_q[i] = lynx5().joints[i].lower_q;
    settings.soft_limits->upper_q[i] = lynx5().joints[i].upper_q;
  }
  settings.soft_limits->lower_q[static_cast<std::size_t>(joint)] = deg(lower_deg);
  settings.soft_limits->upper_q[static_cast<std::size_t>(joint)] = deg(upper_deg);
  return settings;
}

bool is_planned(const PlanResult& result) { return std::holds_alternative<std::vector<Command>>(result); }

void expect_refused(const PlanResult& result, int joint, double lower_deg, double upper_deg) {
  ASSERT_FALSE(is_planned(result));
  const auto& refusal = std::get<PlanRefusal>(result);
  EXPECT_EQ(refusal.kind, Kind::kLimitExceeded) << refusal.text;
  EXPECT_EQ(refusal.parameter, "joint range");
  EXPECT_EQ(refusal.joint, joint);
  EXPECT_NEAR(refusal.lower, deg(lower_deg), 1e-9);
  EXPECT_NEAR(refusal.upper, deg(upper_deg), 1e-9);
  EXPECT_TRUE(refusal.value < refusal.lower || refusal.value > refusal.upper) << refusal.text;
}

TEST(SoftLimits, JointTargetsKeepThem) {
  const Planner planner(lynx5());
  const PlanSettings settings = limited(0, -20.0, 30.0);
  Joints target = kBent.position_q;
  for (const double inside_deg : {-20.0, 0.0, 30.0}) {
    target[0] = deg(inside_deg);
    EXPECT_TRUE(is_planned(planner.move_joints(kBent, settings, target, 0.0))) << inside_deg;
  }
  for (const double outside_deg : {-20.1, 30.1, 80.0}) {
    target[0] = deg(outside_deg);
    expect_refused(planner.move_joints(kBent, settings, target, 0.0), 0, -20.0, 30.0);
    EXPECT_TRUE(is_planned(planner.move_joints(kBent, {}, target, 0.0))) << "without them";
  }
  expect_refused(planner.drive(kBent, settings, 0, deg(60.0), deg(10.0)), 0, -20.0, 30.0);
  EXPECT_TRUE(is_planned(planner.drive(kBent, {}, 0, deg(60.0), deg(10.0))));
  expect_refused(planner.ready(kBent, limited(1, 20.0, 90.0)), 1, 20.0, 90.0);
}

TEST(SoftLimits, PointsAndPathsKeepThem) {
  const Planner planner(lynx5());
  // From one side to the other, past the middle.
  const PlanStart left{{deg(30.0), deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
  const std::array<double, 3> from = test::tcp_of(lynx5(), left.position_q);
  const std::array<double, 3> right{from[0], -from[1], from[2]};
  ASSERT_TRUE(is_planned(planner.move(left, {}, right, 0.0)));
  ASSERT_TRUE(is_planned(planner.move_s(left, {}, right, 0.0)));
  expect_refused(planner.move(left, limited(0, -10.0, 90.0), right, 0.0), 0, -10.0, 90.0);
  expect_refused(planner.move_s(left, limited(0, -10.0, 90.0), right, 0.0), 0, -10.0, 90.0);
}

TEST(SoftLimits, AnEndInsideDoesNotHideAWayOutside) {
  const Planner planner(lynx5());
  // The middle of the chord is nearer to the base than its ends: the elbow bends further there.
  const PlanStart left{{deg(40.0), deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
  const std::array<double, 3> from = test::tcp_of(lynx5(), left.position_q);
  const std::array<double, 3> right{from[0], -from[1], from[2]};
  const PlanSettings narrow = limited(2, -30.0, 61.0);
  ASSERT_TRUE(is_planned(planner.move_s(left, {}, right, 0.0)));
  expect_refused(planner.move_s(left, narrow, right, 0.0), 2, -30.0, 61.0);
  EXPECT_TRUE(is_planned(planner.move(left, narrow, right, 0.0))) << "a free motion only turns the base";
}

TEST(SoftLimits, AnArmOutsideComesBackByItsJoints) {
  const Planner planner(lynx5());
  const PlanStart outside{{deg(60.0), deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
  const PlanSettings settings = limited(0, -20.0, 30.0);
  Joints target = outside.position_q;
  target[0] = 0.0;
  EXPECT_TRUE(is_planned(planner.move_joints(outside, settings, target, 0.0)));
  const std::array<double, 3> ahead = test::tcp_of(lynx5(), target);
  ASSERT_FALSE(is_planned(planner.move_s(outside, settings, ahead, 0.0))) << "a path begins inside";
  EXPECT_TRUE(is_planned(planner.dwell(outside, 1.0)));
  EXPECT_TRUE(is_planned(planner.gripper(outside, 1.0)));
}

void expect_task_takes(const ArmModel& arm, const PlanResult& result) {
  ASSERT_TRUE(is_planned(result));
  const Command command = std::get<std::vector<Command>>(result).front();
  EXPECT_EQ(test::gate(arm, command, result.rates.front()), Verdict::kDone);
}

PlanSettings last_joint_within(const ArmModel& arm, double lower_q, double upper_q) {
  PlanSettings settings;
  settings.soft_limits.emplace();
  for (std::size_t i = 0; i < arm.dof; ++i) {
    settings.soft_limits->lower_q[i] = i + 1 < arm.dof ? arm.joints[i].lower_q : lower_q;
    settings.soft_limits->upper_q[i] = i + 1 < arm.dof ? arm.joints[i].upper_q : upper_q;
  }
  return settings;
}

TEST(SoftLimits, LeaveEachJointAtTheTurnThatTheTaskTakes) {
  ArmModel arm = test::published_arm("scara_gx4");
  arm.joints[3].lower_q = deg(-360);
  arm.joints[3].upper_q = deg(360);
  const Kinematics& kinematics = arm.kinematics;
  int planned = 0, further = 0;
  for (const double turn_deg : {-170.0, -90.0, 90.0, 170.0}) {
    for (const double start_deg : {-100.0, 100.0}) {
      const Joints from{deg(-50), deg(90), -0.05, deg(start_deg), 0.0, 0.0};
      const Joints to{deg(50), deg(90), -0.05, deg(start_deg), 0.0, 0.0};
      const Pose target{kinematics.forward(to).position_m,
                        about({0, 0, 1}, deg(turn_deg)) * kinematics.forward(from).orientation};
      const MovePoseRequest request{target, 0.0, true};
      const Planner planner(arm);
      const bool is_possible = is_planned(planner.plan({from, 0.0}, {}, request));
      for (const double lower_deg : {-345.0, -280.0, -200.0, -110.0}) {
        const PlanSettings settings = last_joint_within(arm, deg(lower_deg), deg(lower_deg + 350.0));
        const PlanResult result = planner.plan({from, 0.0}, settings, request);
        if (!is_planned(result)) continue;
        ++planned;
        further += is_possible ? 0 : 1;
        expect_task_takes(arm, result);
      }
    }
  }
  EXPECT_GT(planned, 5);
  EXPECT_EQ(further, 0) << "narrower limits allow nothing that the wider ones do not";
}

TEST(SoftLimits, LeaveAJointThatStandsHalfATurnOffWhereItIs) {
  ArmModel arm = test::published_arm("puma560");
  arm.joints[5].lower_q = -std::numbers::pi;
  arm.joints[5].upper_q = std::numbers::pi;
  const Planner planner(arm);
  const PlanStart start{{0.1, 0.8, -2.6, 0.2, 0.9, -std::numbers::pi}, 0.0};
  const Vector3 here_m = arm.kinematics.forward(start.position_q).position_m;
  const PlanResult result =
      planner.move_s(start, last_joint_within(arm, -std::numbers::pi, -1.0), here_m, 0.0);
  if (is_planned(result)) expect_task_takes(arm, result);
  EXPECT_EQ(is_planned(result), is_planned(planner.move_s(start, {}, here_m, 0.0)));
}

/// The real-time task does not know them: at which of its turns a joint is it decides by the range of the
/// profile.
TEST(SoftLimits, APathIsPlannedAtTheTurnsAtWhichTheTaskWillRunIt) {
  ArmModel arm = test::wide_arm();
  arm.joints[0].lower_q = deg(-360);
  arm.joints[0].upper_q = deg(360);
  PlanSettings settings;
  settings.tool_pitch_rad = pitch_of_angle(arm.kinematics, arm.kinematics.followed().at(kBent.position_q)[0]);
  settings.soft_limits.emplace();
  for (std::size_t i = 0; i < 4; ++i) {
    settings.soft_limits->lower_q[i] = deg(-175);
    settings.soft_limits->upper_q[i] = deg(175);
  }
  PlanStart start = kBent;
  start.position_q[0] = deg(-170);
  const auto at = [&](double joint_deg) {
    Joints q = start.position_q;
    q[0] = deg(joint_deg);
    return test::tcp_of(arm, q);
  };
  // About the base axis, by 100 degrees, and by more than half a turn.
  for (const double by_deg : {100.0, 300.0}) {
    const PlanResult result =
        Planner(arm).move_c(start, settings, at(-170.0), at(-170.0 + by_deg / 2), at(-170.0 + by_deg));
    if (!is_planned(result)) {
      EXPECT_GT(by_deg, 180.0) << std::get<PlanRefusal>(result).text;
      EXPECT_EQ(std::get<PlanRefusal>(result).parameter, "joint range");
      continue;
    }
    for (const Command& command : std::get<std::vector<Command>>(result)) {
      ASSERT_EQ(command.kind, MotionKind::kArc);
      for (int k = 0; k <= 16; ++k) {
        const IkSolution there =
            joints_at(arm, point_at(command.arc, k / 16.0), command.arc.solution, start.position_q);
        ASSERT_EQ(there.status, IkStatus::kOk);
        EXPECT_GE(there.joints_q[0], deg(-175.0)) << by_deg << " at " << k << "/16";
        if (k == 16) {
          EXPECT_NEAR(there.joints_q[0], command.end_q[0], 1e-9) << by_deg;
        }
      }
    }
  }
}

}  // namespace
}  // namespace corbot::soft_limits_test
