// SPDX-License-Identifier: Apache-2.0
// Tool frame, base frame and solutions, as an ordinary client sets and feels them, and across restarts.
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>
#include <limits>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

/// 50 mm further ahead than the profile's.
const Corbot::Pose kLonger{{0.05, 0.0, 0.0}, {std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0}};
/// Turned by a quarter about z.
const Corbot::Pose kElsewhere{{2.0, -1.0, 0.5}, {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)}};

class FramesOfAnArm : public RobotRig {
 protected:
  static void expect_same(const Corbot::Pose& a, const Corbot::Pose& b) {
    EXPECT_NEAR(a.position.x, b.position.x, 1e-12);
    EXPECT_NEAR(a.position.y, b.position.y, 1e-12);
    EXPECT_NEAR(a.position.z, b.position.z, 1e-12);
    EXPECT_NEAR(a.orientation.w, b.orientation.w, 1e-12);
    EXPECT_NEAR(a.orientation.x, b.orientation.x, 1e-12);
    EXPECT_NEAR(a.orientation.y, b.orientation.y, 1e-12);
    EXPECT_NEAR(a.orientation.z, b.orientation.z, 1e-12);
  }
  void expect_at(double x, double y, double z) {
    const Corbot::CartesianCoord now = arm_->CartCoord();
    EXPECT_NEAR(now.x, x, 1e-6);
    EXPECT_NEAR(now.y, y, 1e-6);
    EXPECT_NEAR(now.z, z, 1e-6);
    Corbot::ArmState_var state = arm_->State();
    EXPECT_NEAR(state->toolCommanded.position.x, x, 1e-9);
    EXPECT_NEAR(state->toolCommanded.position.y, y, 1e-9);
    EXPECT_NEAR(state->toolCommanded.position.z, z, 1e-9);
  }
  void restart_servant_by_kill() {
    servant_->signal(SIGKILL);
    ASSERT_TRUE(servant_->wait(within(30)));
    start_servant();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_ = connect(); }).empty(); }));
    ASSERT_TRUE(wait_for(Corbot::Standby));
  }
};

TEST_F(FramesOfAnArm, MotionsAndReadsAreOfThoseInForce) {
  const Corbot::Pose own_tool = arm_->ToolFrame(), own_base = arm_->BaseFrame();
  arm_->Move(0.22, 0.0, 0.1, 0.0, 0.0);
  arm_->SetToolFrame(kLonger);
  expect_same(arm_->ToolFrame(), kLonger);
  expect_at(0.27, 0.0, 0.1);
  arm_->MoveS(0.27, 0.05, 0.1, 0.0, 0.0);
  expect_at(0.27, 0.05, 0.1);
  arm_->SetBaseFrame(kElsewhere);
  expect_same(arm_->BaseFrame(), kElsewhere);
  expect_at(2.0 - 0.05, -1.0 + 0.27, 0.6);
  arm_->MoveS(2.0, -1.0 + 0.27, 0.6, 0.0, 0.0);
  expect_at(2.0, -1.0 + 0.27, 0.6);
  arm_->MoveC({2.02, -0.74, 0.6}, {2.0, -0.72, 0.6}, {1.98, -0.74, 0.6});
  expect_at(1.98, -0.74, 0.6);
  try {
    arm_->Move(0.22, 0.0, 0.1, 0.0, 0.0);
    ADD_FAILURE() << "that is not where the arm stands";
  } catch (const Corbot::Unreachable& refused) {
    EXPECT_EQ(refused.target.x, 0.22) << "as it was given";
  }
  arm_->ResetFrames();
  expect_same(arm_->ToolFrame(), own_tool);
  expect_same(arm_->BaseFrame(), own_base);
  arm_->Move(0.22, 0.0, 0.1, 0.0, 0.0);
  expect_at(0.22, 0.0, 0.1);
}

TEST_F(FramesOfAnArm, RefuseWhatIsNone) {
  const auto refused = [&](const Corbot::Pose& frame, bool tool) -> std::string {
    try {
      tool ? arm_->SetToolFrame(frame) : arm_->SetBaseFrame(frame);
    } catch (const Corbot::BadParameter& bad) {
      return std::string(bad.parameter) + ": " + std::string(bad.reason);
    }
    return "";
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {kNaN, HUGE_VAL, -HUGE_VAL, 101.0}) {
    EXPECT_THAT(refused({{0.0, wrong, 0.0}, {1.0, 0.0, 0.0, 0.0}}, true), HasSubstr("flange_T_tool: "))
        << wrong;
    EXPECT_THAT(refused({{0.0, wrong, 0.0}, {1.0, 0.0, 0.0, 0.0}}, false), HasSubstr("world_T_base: "))
        << wrong;
    EXPECT_THAT(refused({{0.0, 0.0, 0.0}, {1.0, 0.0, wrong, 0.0}}, false), HasSubstr("world_T_base: "))
        << wrong;
  }
  EXPECT_THAT(refused({{0.0, 0.0, 0.0}, {0.5, -0.5, 0.5, 0.5}}, true), HasSubstr("no pitch"));
  EXPECT_EQ(refused({{0.0, 0.0, 0.0}, {-1.0, 0.0, 0.0, 0.0}}, false), "") << "the same rotation";
  EXPECT_EQ(arm_->BaseFrame().orientation.w, 1.0);
}

TEST_F(FramesOfAnArm, OutliveAServantsKill) {
  arm_->SetToolFrame(kLonger);
  arm_->SetBaseFrame(kElsewhere);
  restart_servant_by_kill();
  if (HasFatalFailure()) return;
  expect_same(arm_->ToolFrame(), kLonger);
  expect_same(arm_->BaseFrame(), kElsewhere);
  arm_->Move(2.0, -1.0 + 0.27, 0.6, 0.0, 0.0);
  arm_->MoveS(1.96, -1.0 + 0.27, 0.6, 0.0, 0.0);
  expect_at(1.96, -1.0 + 0.27, 0.6);
}

TEST_F(FramesOfAnArm, SolutionsAreAllOfTheArmWithTheOneInUse) {
  arm_->SetToolFrame(kLonger);
  arm_->Move(0.25, 0.03, 0.1, 0.0, 0.0);
  Corbot::ArmState_var now = arm_->State();
  const CORBA::Long in_use = arm_->Solution();
  Corbot::PoseSolutions_var all = arm_->Solutions(now->toolCommanded);
  ASSERT_GE(all->length(), 2u);
  int matching = 0;
  for (CORBA::ULong k = 0; k < all->length(); ++k) {
    ASSERT_EQ(all[k].joints.length(), 4u);
    if (static_cast<CORBA::Long>(all[k].number) != in_use) continue;
    ++matching;
    EXPECT_TRUE(all[k].withinLimits);
    EXPECT_LT(all[k].orientationError, 1e-6);
    for (CORBA::ULong i = 0; i < 4; ++i) EXPECT_NEAR(all[k].joints[i], now->commanded[i], 1e-6);
  }
  EXPECT_EQ(matching, 1);
  Corbot::Pose beyond = now->toolCommanded;
  beyond.position.x = 5.0;
  EXPECT_EQ(raised_by([&] { Corbot::PoseSolutions_var none = arm_->Solutions(beyond); }), "Unreachable");
  beyond.position.x = HUGE_VAL;
  EXPECT_EQ(raised_by([&] { Corbot::PoseSolutions_var none = arm_->Solutions(beyond); }), "BadParameter");
}

}  // namespace
}  // namespace corbot::test
