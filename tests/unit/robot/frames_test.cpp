// SPDX-License-Identifier: Apache-2.0
// Tool and base frame of a robot: what is read of it and moved with it, who may set them, and what is left of
// them.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "robot/called_robot.h"

namespace corbot::test::frames_test {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const corbot_tool_pose kNone{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
/// 50 mm further ahead than the profile's.
const corbot_tool_pose kLonger{{0.05, 0.0, 0.0}, {std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0}};
const corbot_tool_pose kElsewhere{{2.0, -1.0, 0.5}, {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)}};

class CalledFrames : public CalledRobot {
 protected:
  corbot_status set_tool(const corbot_tool_pose& tool, const std::string& key = "") {
    const corbot_caller from = caller(key);
    return corbot_robot_set_tool_frame(called_.get(), &from, &tool, &error_);
  }
  corbot_status set_base(const corbot_tool_pose& base, const std::string& key = "") {
    const corbot_caller from = caller(key);
    return corbot_robot_set_base_frame(called_.get(), &from, &base, &error_);
  }
  corbot_status reset(const std::string& key = "") {
    const corbot_caller from = caller(key);
    return corbot_robot_reset_frames(called_.get(), &from, &error_);
  }
  [[nodiscard]] corbot_tool_pose tool() const { return frames().first; }
  [[nodiscard]] corbot_tool_pose base() const { return frames().second; }
  [[nodiscard]] std::pair<corbot_tool_pose, corbot_tool_pose> frames() const {
    corbot_tool_pose tool{}, base{};
    corbot_robot_frames(called_.get(), &tool, &base);
    return {tool, base};
  }
  corbot_arm_state state() {
    corbot_arm_state now{};
    EXPECT_EQ(corbot_robot_arm_state(called_.get(), &now, &error_), CORBOT_OK) << error_.text;
    return now;
  }
  corbot_pose cartesian() {
    corbot_pose now{};
    EXPECT_EQ(corbot_robot_pose(called_.get(), &now, &error_), CORBOT_OK) << error_.text;
    return now;
  }
  void move(bool straight, const double (&p_m)[3]) {
    const corbot_caller from = caller(public_);
    const auto start = straight ? corbot_robot_move_s : corbot_robot_move;
    ASSERT_EQ(start(called_.get(), &from, p_m, 0.0, 0.0, &ticket_, &error_), CORBOT_OK) << error_.text;
    ASSERT_EQ(end_of(ticket_).state, CORBOT_MOTION_DONE);
  }
  static void expect_same(const corbot_tool_pose& a, const corbot_tool_pose& b) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(a.position_m[i], b.position_m[i], 1e-12) << i;
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(a.orientation[i], b.orientation[i], 1e-12) << i;
  }
};

TEST_F(CalledFrames, AreTheProfilesUntilTheyAreSetAndAfterTheyAreReset) {
  open_at_rest();
  const auto [own_tool, own_base] = frames();
  const Frames profile = frames_of(profile_.arm.kinematics);
  EXPECT_NEAR(own_tool.orientation[1], profile.n_T_tool.orientation.x, 1e-12);
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  expect_same(tool(), kLonger);
  expect_same(base(), own_base);
  ASSERT_EQ(set_base(kElsewhere), CORBOT_OK) << error_.text;
  expect_same(base(), kElsewhere);
  ASSERT_EQ(reset(), CORBOT_OK) << error_.text;
  expect_same(tool(), own_tool);
  expect_same(base(), own_base);
}

TEST_F(CalledFrames, AllThatIsReadIsOfTheToolAndTheBaseInForce) {
  open_at_rest();
  move(false, {0.2, 0.05, 0.1});
  const corbot_tool_pose before = state().tool_commanded;
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  const corbot_tool_pose longer = state().tool_commanded;
  EXPECT_NEAR(
      std::hypot(longer.position_m[0] - before.position_m[0], longer.position_m[1] - before.position_m[1],
                 longer.position_m[2] - before.position_m[2]),
      0.05, 1e-12);
  ASSERT_EQ(set_base(kElsewhere), CORBOT_OK) << error_.text;
  const corbot_arm_state now = state();
  // A quarter turn about z, then the offset.
  EXPECT_NEAR(now.tool.position_m[0], 2.0 - longer.position_m[1], 1e-12);
  EXPECT_NEAR(now.tool.position_m[1], -1.0 + longer.position_m[0], 1e-12);
  EXPECT_NEAR(now.tool.position_m[2], 0.5 + longer.position_m[2], 1e-12);
  expect_same(now.tool, now.tool_commanded);
  const corbot_pose pose = cartesian();
  EXPECT_NEAR(pose.x_m, now.tool.position_m[0], 1e-12);
  EXPECT_NEAR(pose.y_m, now.tool.position_m[1], 1e-12);
  EXPECT_NEAR(pose.z_m, now.tool.position_m[2], 1e-12);
}

TEST_F(CalledFrames, MotionsBringTheToolWhereItIsToldInTheWorld) {
  open_at_rest();
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  ASSERT_EQ(set_base(kElsewhere), CORBOT_OK) << error_.text;
  for (const bool straight : {false, true}) {
    const double p_m[3] = {2.0 - (straight ? 0.04 : -0.02), -1.0 + 0.22, 0.5 + 0.1};
    move(straight, p_m);
    const corbot_arm_state now = state();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(now.tool.position_m[i], p_m[i], 1e-9) << straight << i;
  }
  const double own_base[3] = {0.22, 0.0, 0.1};
  const corbot_caller from = caller(public_);
  EXPECT_EQ(corbot_robot_move(called_.get(), &from, own_base, 0.0, 0.0, &ticket_, &error_),
            CORBOT_UNREACHABLE);
  EXPECT_EQ(error_.target_m[0], 0.22) << "as it was given";
}

TEST_F(CalledFrames, WhatWasAcceptedBeforeGoesOnWithItsOwn) {
  open_at_rest();
  move(false, {0.2, 0.05, 0.1});
  const corbot_caller from = caller(public_);
  const double p_m[3] = {0.2, -0.05, 0.1};
  ASSERT_EQ(corbot_robot_move_s(called_.get(), &from, p_m, 0.0, 2.0, &ticket_, &error_), CORBOT_OK)
      << error_.text;
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  ASSERT_EQ(end_of(ticket_).state, CORBOT_MOTION_DONE);
  ASSERT_EQ(reset(), CORBOT_OK);
  const corbot_arm_state now = state();
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(now.tool.position_m[i], p_m[i], 1e-9);
}

TEST_F(CalledFrames, ThatAreNoneAreRefusedAndChangeNothing) {
  open_at_rest();
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  corbot_tool_pose wrong = kNone;
  wrong.position_m[2] = kNan;
  EXPECT_EQ(set_tool(wrong), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "flange_T_tool");
  EXPECT_EQ(set_base(wrong), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "world_T_base");
  wrong.position_m[2] = 101.0;
  EXPECT_EQ(set_base(wrong), CORBOT_BAD_PARAMETER);
  EXPECT_EQ(error_.value, 101.0);
  EXPECT_EQ(error_.upper, 100.0);
  EXPECT_EQ(set_tool({{0, 0, 0}, {0.5, 0.5, 0.5, 0.4}}), CORBOT_BAD_PARAMETER);
  EXPECT_THAT(error_.text, HasSubstr("allowed 1 within 1e-06"));
  EXPECT_EQ(set_tool({{0, 0, 0}, {0.5, -0.5, 0.5, 0.5}}), CORBOT_BAD_PARAMETER)
      << "x square to the arm's plane";
  EXPECT_THAT(error_.text, HasSubstr("no pitch"));
  expect_same(tool(), kLonger);
}

TEST_F(CalledFrames, NeedControlAndReadsDoNot) {
  open_at_rest();
  const std::string key = acquire("cell", kLong_s);
  for (const auto status : {set_tool(kLonger), set_base(kElsewhere), reset()})
    EXPECT_EQ(status, CORBOT_NOT_READY);
  EXPECT_THAT(error_.text, HasSubstr("'cell' has control"));
  EXPECT_EQ(set_tool(kLonger, key), CORBOT_OK) << error_.text;
  expect_same(tool(), kLonger);
  EXPECT_EQ(reset(key), CORBOT_OK) << error_.text;
}

TEST_F(CalledFrames, OutliveAServant) {
  open_at_rest();
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  ASSERT_EQ(set_base(kElsewhere), CORBOT_OK) << error_.text;
  for (int i = 0; i < 2; ++i) {
    restart_servant();
    expect_same(tool(), kLonger);
    expect_same(base(), kElsewhere);
  }
  ASSERT_EQ(reset(), CORBOT_OK);
  const auto own = frames();
  restart_servant();
  expect_same(tool(), own.first);
  EXPECT_EQ(tool().position_m[0], 0.0);
}

TEST_F(CalledFrames, SolutionsAreAtAPoseInTheFramesInForce) {
  open_at_rest();
  corbot_robot_keep_state(called_.get(), directory_.c_str(), nullptr);
  ASSERT_EQ(set_tool(kLonger), CORBOT_OK) << error_.text;
  ASSERT_EQ(set_base(kElsewhere), CORBOT_OK) << error_.text;
  move(false, {2.0 - 0.03, -1.0 + 0.22, 0.5 + 0.1});
  const corbot_arm_state now = state();
  int32_t in_use = -2;
  ASSERT_EQ(corbot_robot_solution(called_.get(), &in_use, &error_), CORBOT_OK) << error_.text;
  corbot_pose_solution found[CORBOT_MAX_SOLUTIONS];
  size_t count = 0;
  ASSERT_EQ(corbot_robot_solutions(called_.get(), &now.tool, found, &count, &error_), CORBOT_OK)
      << error_.text;
  ASSERT_GE(count, 2u);
  bool is_there = false;
  for (size_t k = 0; k < count; ++k) {
    if (k > 0) {
      EXPECT_GT(found[k].number, found[k - 1].number);
    }
    if (static_cast<int32_t>(found[k].number) != in_use) continue;
    is_there = true;
    EXPECT_EQ(found[k].in_range, 1);
    EXPECT_LT(found[k].orientation_error_deg, 1e-6);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(found[k].joints[i], now.commanded[i], 1e-6);
  }
  EXPECT_TRUE(is_there);

  corbot_joint_ranges narrow{};
  ASSERT_EQ(corbot_robot_soft_limits(called_.get(), &narrow), 1);
  for (int i = 0; i < 4; ++i) narrow.lower[i] = std::floor(now.commanded[i]);
  narrow.upper[2] = std::ceil(now.commanded[2]);
  const corbot_caller from = caller(public_);
  ASSERT_EQ(corbot_robot_set_soft_limits(called_.get(), &from, &narrow, 4, &error_), CORBOT_OK)
      << error_.text;
  ASSERT_EQ(corbot_robot_solutions(called_.get(), &now.tool, found, &count, &error_), CORBOT_OK)
      << error_.text;
  for (size_t k = 0; k < count; ++k)
    EXPECT_EQ(found[k].in_range, static_cast<int32_t>(found[k].number) == in_use);

  corbot_tool_pose beyond = now.tool;
  beyond.position_m[0] = 5.0;
  EXPECT_EQ(corbot_robot_solutions(called_.get(), &beyond, found, &count, &error_), CORBOT_UNREACHABLE);
  EXPECT_EQ(error_.target_m[0], 5.0);
  beyond.position_m[0] = kNan;
  EXPECT_EQ(corbot_robot_solutions(called_.get(), &beyond, found, &count, &error_), CORBOT_BAD_PARAMETER);
}

}  // namespace
}  // namespace corbot::test::frames_test
