// SPDX-License-Identifier: Apache-2.0
// Poses, offsets and the orientation that is set, as the adapters call them: a six-axis arm and the paper's,
// over the real cycle.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "robot/called_robot.h"
#include "support/paths.h"

namespace corbot::test::poses_test {
namespace {

using ::testing::HasSubstr;

/// A profile of the tests for a machine that is busier still, which lets the task stand still for a while.
std::string patient(const std::string& arm) {
  std::ifstream profile(CORBOT_TEST_PROFILES "/" + arm + ".toml");
  std::string text(std::istreambuf_iterator<char>(profile), {});
  const std::string key = "frozen_ms = 2000";
  text.replace(text.find(key), key.size(), "frozen_ms = 10000");
  const std::string path = CORBOT_SCRATCH_DIR "/poses-" + std::to_string(::getpid()) + "-" + arm + ".toml";
  std::ofstream(path) << text;
  return path;
}

class PoseCalls : public CalledRobot {
 protected:
  explicit PoseCalls(const std::string& arm) : CalledRobot(patient(arm).c_str()) {}
  ~PoseCalls() override { std::filesystem::remove(profile_.file); }

  corbot_arm_state state() {
    corbot_arm_state now{};
    corbot_error error{};
    EXPECT_EQ(corbot_robot_arm_state(called_.get(), &now, &error), CORBOT_OK) << error.text;
    return now;
  }
  Pose tool() {
    const corbot_tool_pose at = state().tool_commanded;
    const double* const q = at.orientation;
    return {{at.position_m[0], at.position_m[1], at.position_m[2]}, {q[0], q[1], q[2], q[3]}};
  }
  static corbot_tool_pose given(const Pose& pose) {
    const Quaternion& q = pose.orientation;
    return {{pose.position_m[0], pose.position_m[1], pose.position_m[2]}, {q.w, q.x, q.y, q.z}};
  }
  void expect_done(corbot_status status) {
    ASSERT_EQ(status, CORBOT_OK) << error_.text;
    const corbot_motion_info end = end_of(ticket_);
    ASSERT_EQ(end.state, CORBOT_MOTION_DONE) << end.reason;
  }
  void expect_tool_at(const Pose& wanted) {
    ASSERT_TRUE(wait_until(within(30), [&] { return norm(tool().position_m - wanted.position_m) < 1e-9; }))
        << norm(tool().position_m - wanted.position_m);
    EXPECT_LT(angle_between(tool().orientation, wanted.orientation), 1e-8);
  }
  corbot_status move_pose(const Pose& target, double t_s = 0.0) {
    const corbot_tool_pose pose = given(target);
    return corbot_robot_move_pose(called_.get(), nullptr, &pose, t_s, &ticket_, &error_);
  }
  corbot_status move_pose_s(const Pose& target, double t_s = 0.0) {
    const corbot_tool_pose pose = given(target);
    return corbot_robot_move_pose_s(called_.get(), nullptr, &pose, t_s, &ticket_, &error_);
  }
  corbot_status relative_s(const Pose& offset, int32_t frame) {
    const corbot_tool_pose pose = given(offset);
    return corbot_robot_move_relative_s(called_.get(), nullptr, &pose, frame, 0.0, &ticket_, &error_);
  }
  corbot_status set_orientation(const std::array<double, 4>& q) {
    return corbot_robot_set_tool_orientation(called_.get(), nullptr, q.data(), &error_);
  }
};

class PumaPoseCalls : public PoseCalls {
 protected:
  PumaPoseCalls() : PoseCalls("puma560") {}
};
class LynxPoseCalls : public PoseCalls {
 protected:
  LynxPoseCalls() : PoseCalls("lynx5") {}
};

TEST_F(PumaPoseCalls, BothMotionsEndAtThePoseAndTakeTheirTime) {
  open_at_rest();
  const Pose here = tool();
  const Pose there{here.position_m + Vector3{-0.03, 0.04, 0.02}, about({0, 0, 1}, 0.3) * here.orientation};
  expect_done(move_pose(there));
  expect_tool_at(there);
  ASSERT_EQ(move_pose_s(here, 1.5), CORBOT_OK) << error_.text;
  EXPECT_EQ(end_of(ticket_).duration_s, 1.5);
  expect_tool_at(here);
}

TEST_F(PumaPoseCalls, OffsetsCountFromWhereTheArmWillBeWhenTheirMotionBegins) {
  open_at_rest();
  const Pose here = tool();
  const Pose along{{0.0, 0.0, -0.03}, about({0, 1, 0}, 0.1)};
  const Pose aside{{0.02, -0.01, 0.0}, about({0, 0, 1}, 0.2)};
  ASSERT_EQ(corbot_robot_delay(called_.get(), nullptr, 0.2, &ticket_, &error_), CORBOT_OK) << error_.text;
  ASSERT_EQ(relative_s(along, CORBOT_OFFSET_IN_TOOL), CORBOT_OK) << error_.text;
  const corbot_tool_pose by = given(along);
  ASSERT_EQ(
      corbot_robot_move_relative(called_.get(), nullptr, &by, CORBOT_OFFSET_IN_TOOL, 0.0, &ticket_, &error_),
      CORBOT_OK)
      << error_.text;
  expect_done(relative_s(aside, CORBOT_OFFSET_IN_BASE));
  const Pose twice = here * along * along;
  expect_tool_at({twice.position_m + aside.position_m, aside.orientation * twice.orientation});
}

TEST_F(PumaPoseCalls, TheOrientationThatIsSetHoldsForMoveUntilItIsTakenBack) {
  open_at_rest();
  const Pose here = tool();
  const Quaternion turned = about({1, 0, 0}, 0.25) * here.orientation;
  const auto move_s = [&](const Vector3& to_m) {
    return corbot_robot_move_s(called_.get(), nullptr, to_m.data(), 0.0, 0.0, &ticket_, &error_);
  };
  double set[4];
  EXPECT_EQ(corbot_robot_tool_orientation(called_.get(), set), 0);
  EXPECT_EQ(set[0], 1.0);
  ASSERT_EQ(set_orientation({-turned.w, -turned.x, -turned.y, -turned.z}), CORBOT_OK) << error_.text;
  const Vector3 aside_m = here.position_m + Vector3{0.0, 0.03, 0.01};
  expect_done(move_s(aside_m));
  expect_tool_at({aside_m, turned});

  restart_servant();
  ASSERT_EQ(corbot_robot_tool_orientation(called_.get(), set), 1) << "it outlives its servant";
  EXPECT_GE(set[0], 0.0);
  EXPECT_LT(angle_between({set[0], set[1], set[2], set[3]}, turned), 1e-15);
  expect_done(move_pose(here));
  expect_done(move_s(aside_m));
  expect_tool_at({aside_m, turned});

  expect_done(move_pose(here));
  ASSERT_EQ(corbot_robot_reset_tool_orientation(called_.get(), nullptr, &error_), CORBOT_OK);
  EXPECT_EQ(corbot_robot_tool_orientation(called_.get(), set), 0);
  expect_done(move_s(aside_m));
  expect_tool_at({aside_m, here.orientation});
}

TEST_F(PumaPoseCalls, WhatIsNoOrientationIsRefusedWithItsValueAndTheLimit) {
  open();
  EXPECT_EQ(set_orientation({1.0, 0.1, 0.0, 0.0}), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "orientation");
  EXPECT_NEAR(error_.value, std::sqrt(1.01), 1e-15);
  EXPECT_THAT(error_.text, HasSubstr("has length 1.00499, allowed 1 within 1e-06"));
  EXPECT_EQ(set_orientation({0.0, 0.0, std::numeric_limits<double>::infinity(), 0.0}), CORBOT_BAD_PARAMETER);
  EXPECT_THAT(error_.text, HasSubstr("y of orientation is inf"));
  double set[4];
  EXPECT_EQ(corbot_robot_tool_orientation(called_.get(), set), 0);
  EXPECT_EQ(move_pose({{0.3, 0.1, 0.5}, {0.0, 0.0, 0.0, 0.0}}), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "target");
  EXPECT_EQ(relative_s({{NAN, 0.0, 0.0}, {}}, CORBOT_OFFSET_IN_TOOL), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "offset");
  EXPECT_EQ(relative_s({}, 2), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "frame");
  EXPECT_EQ(corbot_robot_set_tool_pitch(called_.get(), nullptr, 10.0, &error_), CORBOT_BAD_PARAMETER);
  EXPECT_THAT(error_.text, HasSubstr("no tool pitch"));
}

TEST_F(PumaPoseCalls, TheAuditLogHasThemWithTheirArguments) {
  open_at_rest();
  corbot_robot_keep_state(called_.get(), directory_.c_str(), nullptr);
  expect_done(relative_s({{0.0, 0.0, -0.01}, {}}, CORBOT_OFFSET_IN_TOOL));
  ASSERT_EQ(set_orientation({0.6, 0.8, 0.0, 0.0}), CORBOT_OK);
  ASSERT_EQ(corbot_robot_reset_tool_orientation(called_.get(), nullptr, &error_), CORBOT_OK);
  EXPECT_EQ(move_pose({{9.0, 0.0, 0.0}, {}}), CORBOT_UNREACHABLE);
  called_.reset();
  std::ifstream stream(std::filesystem::path(directory_) / (name_ + ".audit"));
  const std::string log(std::istreambuf_iterator<char>(stream), {});
  for (const char* call :
       {"MoveRelativeS(0, 0, -0.01, 1, 0, 0, 0, OffsetInTool, 0)", "SetToolOrientation(0.6, 0.8, 0, 0)",
        "ResetToolOrientation()", "MovePose(9, 0, 0, 1, 0, 0, 0, 0)", "Unreachable: "}) {
    EXPECT_THAT(log, HasSubstr(call));
  }
}

TEST_F(LynxPoseCalls, AnOrientationThatItCannotTakeIsRefusedWithTheAngleAndTheLimit) {
  open_at_rest();
  const double joints_deg[4] = {20.0, 60.0, 60.0, 30.0};
  expect_done(corbot_robot_move_joints(called_.get(), nullptr, joints_deg, 4, 0.0, &ticket_, &error_));
  const Pose here = tool();
  const Pose rolled{here.position_m, here.orientation * about({1, 0, 0}, 0.1)};
  for (const auto status : {move_pose(rolled), move_pose_s(rolled)}) {
    EXPECT_EQ(status, CORBOT_UNREACHABLE);
    EXPECT_THAT(error_.text, HasSubstr("than 5.72958 degrees, allowed up to 5.72958e-05 degrees"));
  }
  EXPECT_NEAR(error_.target_m[0], here.position_m[0], 1e-12);
  // Its pitch it can change on the spot, and back along its own axes.
  expect_done(relative_s({{-0.01, 0.0, 0.0}, about({0, 1, 0}, 0.2)}, CORBOT_OFFSET_IN_TOOL));
  expect_done(move_pose_s(here));
  expect_tool_at(here);
}

TEST_F(LynxPoseCalls, AnOffsetKeepsTheOrientationOfAnArmThatHangs) {
  open_at_rest();
  const double joints_deg[4] = {20.0, 60.0, 90.0, 60.0};
  expect_done(corbot_robot_move_joints(called_.get(), nullptr, joints_deg, 4, 0.0, &ticket_, &error_));
  for (const Quaternion& base : {Quaternion{}, Quaternion{0.0, 1.0, 0.0, 0.0}}) {
    const corbot_tool_pose hung = given({{0.0, 0.0, 1.0}, base});
    ASSERT_EQ(corbot_robot_set_base_frame(called_.get(), nullptr, &hung, &error_), CORBOT_OK) << error_.text;
    const Pose here = tool();
    expect_done(relative_s({{0.0, 0.0, 0.005}, {}}, CORBOT_OFFSET_IN_BASE));
    expect_tool_at({here.position_m + Vector3{0.0, 0.0, 0.005}, here.orientation});
    expect_done(relative_s({{-0.005, 0.0, 0.0}, {}}, CORBOT_OFFSET_IN_TOOL));
  }
}

TEST_F(LynxPoseCalls, SetToolOrientationSaysWhatTheArmFollows) {
  open();
  EXPECT_EQ(set_orientation({1.0, 0.0, 0.0, 0.0}), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "orientation");
  EXPECT_EQ(error_.value, 4.0);
  EXPECT_THAT(error_.text,
              HasSubstr("follows the tool pitch alone, no other orientation: set the tool pitch"));
  ASSERT_EQ(corbot_robot_set_tool_pitch(called_.get(), nullptr, -20.0, &error_), CORBOT_OK);
  ASSERT_EQ(corbot_robot_reset_tool_orientation(called_.get(), nullptr, &error_), CORBOT_OK);
  EXPECT_EQ(corbot_robot_tool_pitch(called_.get()), 0.0) << "taken back as well";
}

}  // namespace
}  // namespace corbot::test::poses_test
