// SPDX-License-Identifier: Apache-2.0
// Motions keep the soft limits in place of the arm's ranges: targets, and every way there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "corbot/motion/law_evaluation.h"
#include "planner/planner.h"
#include "test_arm.h"

namespace corbot {
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

}  // namespace
}  // namespace corbot
