// SPDX-License-Identifier: Apache-2.0
// Poses, offsets and a tool orientation of a six-axis arm, as an ordinary client uses them.
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>
#include <functional>
#include <string>

#include "corbot/kinematics/pose.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

class SixAxisPoses : public RobotRig {
 protected:
  void SetUp() override {
    profile_ = CORBOT_TEST_PROFILES "/puma560.toml";
    RobotRig::SetUp();
  }

  static Pose own(const Corbot::Pose& from) {
    const Corbot::Quaternion& q = from.orientation;
    return {{from.position.x, from.position.y, from.position.z}, {q.w, q.x, q.y, q.z}};
  }
  static Corbot::Pose corba(const Pose& from) {
    const Quaternion& q = from.orientation;
    return {{from.position_m[0], from.position_m[1], from.position_m[2]}, {q.w, q.x, q.y, q.z}};
  }
  Pose tool() {
    Corbot::ArmState_var state = arm_->State();
    return own(state->toolCommanded);
  }
  void expect_tool_at(const Pose& wanted) {
    const Pose now = tool();
    EXPECT_LT(norm(now.position_m - wanted.position_m), 1e-9);
    EXPECT_LT(angle_between(now.orientation, wanted.orientation), 1e-8);
  }
  void expect_done(Corbot::Ticket ticket) {
    Corbot::MotionInfo_var info = arm_->Wait(ticket, 60.0);
    EXPECT_EQ(info->state, Corbot::MotionDone) << info->reason;
  }
  std::string reason_of(const std::function<void()>& call) {
    try {
      call();
    } catch (const Corbot::BadParameter& refused) {
      return refused.reason.in();
    } catch (const Corbot::Unreachable& refused) {
      return refused.reason.in();
    }
    return "";
  }
};

TEST_F(SixAxisPoses, MotionsEndAtThePose) {
  const Pose here = tool();
  const Pose there{here.position_m + Vector3{-0.04, 0.03, 0.02}, about({0, 0, 1}, 0.4) * here.orientation};
  arm_->MovePose(corba(there), 0.0);
  expect_tool_at(there);
  arm_->MovePoseS(corba(here), 0.0);
  expect_tool_at(here);
  expect_done(arm_->StartMovePose(corba(there), 1.0));
  expect_tool_at(there);
  expect_done(arm_->StartMovePoseS(corba(here), 1.0));
  expect_tool_at(here);
}

TEST_F(SixAxisPoses, OffsetsCountFromTheEndOfWhatIsQueued) {
  const Pose here = tool();
  const Pose approach{{0.0, 0.0, -0.02}, about({0, 0, 1}, 0.1)};
  const Pose aside{{0.01, -0.02, 0.0}, about({1, 0, 0}, 0.1)};
  (void)arm_->StartMoveRelativeS(corba(approach), Corbot::OffsetInTool, 0.0);
  (void)arm_->StartMoveRelative(corba(approach), Corbot::OffsetInTool, 0.0);
  expect_done(arm_->StartMoveRelativeS(corba(aside), Corbot::OffsetInBase, 0.0));
  const Pose twice = here * approach * approach;
  const Pose there{twice.position_m + aside.position_m, aside.orientation * twice.orientation};
  expect_tool_at(there);
  arm_->MoveRelative(corba(approach), Corbot::OffsetInTool, 0.0);
  arm_->MoveRelativeS(corba(inverse_of(approach)), Corbot::OffsetInTool, 0.0);
  expect_tool_at(there);
}

TEST_F(SixAxisPoses, TheOrientationHoldsForMoveMoveSAndMoveCAcrossARestartOfTheServant) {
  const Pose here = tool();
  const Quaternion turned = about({0, 1, 0}, 0.2) * here.orientation;
  const Vector3& p = here.position_m;
  EXPECT_FALSE(arm_->ToolOrientation().set);
  arm_->SetToolOrientation(corba({{}, turned}).orientation);
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  start_servant();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_ = connect(); }).empty(); }));
  ASSERT_TRUE(wait_for(Corbot::Standby));
  const Corbot::ToolOrientationInfo set = arm_->ToolOrientation();
  ASSERT_TRUE(set.set);
  EXPECT_LT(angle_between(own({{}, set.orientation}).orientation, turned), 1e-15);
  arm_->Move(p[0] - 0.02, p[1], p[2], 0.01, 0.0);
  expect_tool_at({{p[0] - 0.02, p[1], p[2] + 0.01}, turned});
  arm_->MovePose(corba(here), 0.0);
  arm_->MoveS(p[0] - 0.02, p[1], p[2], 0.0, 0.0);
  expect_tool_at({{p[0] - 0.02, p[1], p[2]}, turned});
  arm_->MovePose(corba(here), 0.0);
  arm_->MoveC({p[0], p[1], p[2]}, {p[0] - 0.01, p[1] + 0.01, p[2]}, {p[0] - 0.02, p[1], p[2]});
  expect_tool_at({{p[0] - 0.02, p[1], p[2]}, turned});
  arm_->ResetToolOrientation();
  EXPECT_FALSE(arm_->ToolOrientation().set);
  arm_->MovePose(corba(here), 0.0);
  arm_->MoveS(p[0] - 0.02, p[1], p[2], 0.0, 0.0);
  expect_tool_at({{p[0] - 0.02, p[1], p[2]}, here.orientation});
}

TEST_F(SixAxisPoses, RefusalsNameTheValueAndTheLimit) {
  EXPECT_THAT(reason_of([&] {
                arm_->SetToolOrientation({0.9, 0.0, 0.0, 0.0});
              }),
              HasSubstr("has length 0.9, allowed 1 within 1e-06"));
  EXPECT_THAT(reason_of([&] {
                arm_->SetToolOrientation({1.0, std::nan(""), 0.0, 0.0});
              }),
              HasSubstr("x of orientation is nan"));
  EXPECT_THAT(reason_of([&] { arm_->SetToolPitch(10.0); }), HasSubstr("no tool pitch"));
  EXPECT_THAT(reason_of([&] {
                arm_->MovePoseS({{3.0, 0.0, 0.5}, {1, 0, 0, 0}}, 0.0);
              }),
              HasSubstr("too far"));
  EXPECT_FALSE(arm_->ToolOrientation().set);
}

TEST_F(SixAxisPoses, OnlyWhoeverHasControlSetsTheOrientation) {
  Corbot::Arm_var mine = arm_->Acquire("cell", 600.0);
  EXPECT_EQ(raised_by([&] { arm_->SetToolOrientation({1, 0, 0, 0}); }), "NO_PERMISSION");
  EXPECT_EQ(raised_by([&] { mine->SetToolOrientation({1, 0, 0, 0}); }), "");
  EXPECT_TRUE(arm_->ToolOrientation().set);
}

}  // namespace
}  // namespace corbot::test
