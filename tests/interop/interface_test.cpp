// SPDX-License-Identifier: Apache-2.0
// Every attribute and every motion, as an ordinary client sees them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>

#include "config/arms/write_urdf.h"
#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Interface : public RobotRig {
 protected:
  void expect_at(double x, double y, double z, double tolerance_m = 1e-6) {
    const Corbot::CartesianCoord at = arm_->CartCoord();
    EXPECT_NEAR(at.x, x, tolerance_m);
    EXPECT_NEAR(at.y, y, tolerance_m);
    EXPECT_NEAR(at.z, z, tolerance_m);
  }
};

TEST_F(Interface, DescribesTheLynx5) {
  EXPECT_EQ(arm_->RobotType(), Corbot::Anthropomorphic);
  EXPECT_EQ(arm_->DoF(), 4);
  EXPECT_NEAR(arm_->Reach(), 0.34, 1e-9);
  Corbot::JointRanges_var ranges = arm_->MovRange();
  ASSERT_EQ(ranges->length(), 4u);
  EXPECT_EQ(ranges[0].lower, -90.0);
  EXPECT_EQ(ranges[0].upper, 90.0);
  Corbot::JointCoord_var joints = arm_->ArtiCoord();
  ASSERT_EQ(joints->length(), 4u);
  for (CORBA::ULong i = 0; i < 4; ++i) EXPECT_EQ(joints[i], 0.0);
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Close);
  EXPECT_EQ(arm_->OverridePercent(), 100.0);
  EXPECT_EQ(arm_->ToolPitch(), 0.0);
}

TEST_F(Interface, TheTaskLocksNoUsualStacks) {
  if (CORBOT_SANITIZED) GTEST_SKIP() << "skipped: a sanitizer's memory is not the task's";
  const std::string locked = rt_->errors();
  if (locked.find("memory cannot be locked") != std::string::npos) GTEST_SKIP() << "skipped: " << locked;
  EXPECT_LT(rt_->anonymous_kb(), 12'000) << "three of them have 24 MB";
}

TEST_F(Interface, SaysWhichSpeedsAreInForce) {
  arm_->Speed(40.0);
  arm_->ArtSpeed(2, 25.0);
  const Corbot::SpeedSettings_var speeds = arm_->Speeds();
  EXPECT_DOUBLE_EQ(speeds->tool, 40.0);
  ASSERT_EQ(speeds->joints.length(), 4u);
  EXPECT_DOUBLE_EQ(speeds->joints[0], 100.0);
  EXPECT_DOUBLE_EQ(speeds->joints[2], 25.0);
}

TEST_F(Interface, ReadyPoseIsThePapersForwardKinematics) {
  // L0..L3 = 67, 120, 120, 100 mm; A = B = 10, C = -35 degrees.
  const double rad = std::acos(-1.0) / 180.0;
  const Corbot::CartesianCoord at = arm_->CartCoord();
  EXPECT_NEAR(at.x, 0.240 * std::cos(10 * rad) + 0.100 * std::cos(35 * rad), 1e-12);
  EXPECT_NEAR(at.y, 0.0, 1e-12);
  EXPECT_NEAR(at.z, 0.067 + 0.240 * std::sin(10 * rad) - 0.100 * std::sin(35 * rad), 1e-12);
  EXPECT_NEAR(at.a, 0.0, 1e-9);
  EXPECT_NEAR(at.b, -35.0, 1e-9);
  EXPECT_EQ(at.c, 0.0);
}

TEST_F(Interface, MoveArrivesAboveThePointAtToolPitch0) {
  arm_->Move(0.20, 0.05, 0.08, 0.03, 0.0);
  expect_at(0.20, 0.05, 0.11);
  EXPECT_NEAR(arm_->CartCoord().b, 0.0, 1e-6);
  EXPECT_EQ(arm_->Status(), Corbot::Standby) << "at rest when the call returns";
}

TEST_F(Interface, MoveSArrives) {
  arm_->MoveS(0.22, 0.02, 0.10, 0.0,
              0.0);  // from Ready, whose elbow is stretched: the border of the workspace
  expect_at(0.22, 0.02, 0.10);
  arm_->MoveS(0.22, -0.02, 0.10, 0.01, 0.0);
  expect_at(0.22, -0.02, 0.11);
}

TEST_F(Interface, MoveCArrivesAtTheThirdPoint) {
  arm_->MoveC({0.20, -0.03, 0.10}, {0.22, 0.0, 0.12}, {0.20, 0.03, 0.10});
  expect_at(0.20, 0.03, 0.10);
}

TEST_F(Interface, DriveTurnsOneJoint) {
  arm_->Drive(1, 20.0, 90.0);
  Corbot::JointCoord_var joints = arm_->ArtiCoord();
  EXPECT_NEAR(joints[0], 0.0, 1e-9);
  EXPECT_NEAR(joints[1], 20.0, 1e-9);
  arm_->Drive(1, -5.0, 90.0);
  joints = arm_->ArtiCoord();
  EXPECT_NEAR(joints[1], 15.0, 1e-9);
}

TEST_F(Interface, MoveJointsAndReady) {
  Corbot::JointCoord target;
  target.length(4);
  target[0] = 10.0;
  target[1] = 20.0;
  target[2] = 30.0;
  target[3] = 40.0;
  arm_->MoveJoints(target, 0.0);
  Corbot::JointCoord_var joints = arm_->ArtiCoord();
  EXPECT_LT(distance_deg(target, joints), 1e-9);
  arm_->Ready();
  joints = arm_->ArtiCoord();
  for (CORBA::ULong i = 0; i < 4; ++i) EXPECT_NEAR(joints[i], 0.0, 1e-9);
}

TEST_F(Interface, GripperOpensAndCloses) {
  arm_->Open();
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Open);
  arm_->Close();
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Close);
}

TEST_F(Interface, ARequestedTimeIsKeptExactly) {
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.05, 0.10, 0.0, 1.5);
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionDone);
  EXPECT_NEAR(info->duration, 1.5, 1e-9);
}

TEST_F(Interface, SpeedsStretchMotions) {
  const auto duration_of = [&](double y) {
    Corbot::MotionInfo_var info = arm_->Wait(arm_->StartMove(0.20, y, 0.10, 0.0, 0.0), 60.0);
    return info->duration;
  };
  (void)duration_of(0.05);
  const double full_s = duration_of(-0.05);
  arm_->Speed(25.0);
  const double slow_s = duration_of(0.05);
  EXPECT_GT(slow_s, 1.5 * full_s);
  arm_->Speed(100.0);
  arm_->AllSpeed(25.0);
  EXPECT_NEAR(duration_of(-0.05), slow_s, 1e-6);
  arm_->AllSpeed(100.0);
  arm_->ArtSpeed(0, 25.0);
  EXPECT_NEAR(duration_of(0.05), slow_s, 1e-6) << "the base moves furthest and sets the time";
  arm_->ArtSpeed(0, 100.0);
  EXPECT_NEAR(duration_of(-0.05), full_s, 1e-6);
}

TEST_F(Interface, ToolPitchHoldsForTheMovesThatFollow) {
  arm_->SetToolPitch(-30.0);
  EXPECT_NEAR(arm_->ToolPitch(), -30.0, 1e-12);
  arm_->Move(0.20, 0.0, 0.08, 0.0, 0.0);
  expect_at(0.20, 0.0, 0.08);
  EXPECT_NEAR(arm_->CartCoord().b, -30.0, 1e-6);
}

TEST_F(Interface, ZeroLengthMovesSucceed) {
  arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
  const Corbot::CartesianCoord at = arm_->CartCoord();
  arm_->Move(at.x, at.y, at.z, 0.0, 0.0);
  arm_->MoveS(at.x, at.y, at.z, 0.0, 0.0);
  arm_->MoveS(at.x + 1e-15, at.y, at.z, 0.0, 0.0);
  arm_->Drive(0, 0.0, 10.0);
  arm_->Drive(0, 1e-15, 10.0);
  arm_->Delay(0.0);
  expect_at(0.20, 0.05, 0.10);
}

TEST_F(Interface, DiagnosticsCountCycles) {
  Corbot::LoopInfo_var first = arm_->Diagnostics();
  EXPECT_NEAR(first->period, 4e-3, 1e-12);
  ASSERT_EQ(first->counts.length(), first->edges.length());
  ASSERT_GT(first->counts.length(), 10u);
  const CORBA::ULongLong seen = first->cycles;
  ASSERT_TRUE(wait_until(within(30), [&] {
    Corbot::LoopInfo_var now = arm_->Diagnostics();
    return now->cycles > seen;
  }));
  Corbot::LoopInfo_var now = arm_->Diagnostics();
  CORBA::ULongLong sum = 0;
  for (CORBA::ULong i = 0; i < now->counts.length(); ++i) sum += now->counts[i];
  EXPECT_EQ(sum, now->cycles) << "every cycle is in the histogram";
  EXPECT_GT(now->since, 1.6e9);
}

TEST_F(Interface, TheObjectExists) {
  EXPECT_FALSE(arm_->_non_existent());
  EXPECT_TRUE(arm_->_is_a("IDL:Corbot/Arm:1.0"));
}

double now_since_1970_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

TEST_F(Interface, SaysWhatServesIt) {
  EXPECT_EQ(servant_->terminate(), 0);
  const double before_s = now_since_1970_s();
  start_servant();
  if (HasFatalFailure()) return;
  const double after_s = now_since_1970_s();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  Corbot::ServantInfo_var info = arm_->Servant();
  EXPECT_STREQ(info->version, CORBOT_VERSION);
  EXPECT_EQ(std::string(info->profile),
            fmt::format("{:016x}", fingerprint(load_profile(CORBOT_TEST_PROFILE).arm)));
  EXPECT_GE(info->started, before_s);
  EXPECT_LE(info->started, after_s);
}

TEST_F(Interface, DescribesItselfAsAUrdf) {
  const Profile profile = load_profile(CORBOT_TEST_PROFILE);
  const CORBA::String_var urdf = arm_->Description();
  EXPECT_EQ(std::string(urdf), config::write_urdf(profile.arm, profile.name, profile.joint_names));
}

TEST_F(Interface, CycleAgeIsThatOfWhatIsRead) {
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() < 0.02; })) << "twenty periods";
  rt_->signal(SIGSTOP);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() > 0.5; }));
  const double first_s = arm_->CycleAge();
  EXPECT_GE(arm_->CycleAge(), first_s);
  rt_->signal(SIGCONT);
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() < 0.02; }));
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() > 0.5; })) << "gone: the last one's";
  start_rt();
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() < 0.02; }));
}

}  // namespace
}  // namespace corbot::test
