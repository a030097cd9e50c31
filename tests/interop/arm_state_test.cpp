// SPDX-License-Identifier: Apache-2.0
// The State attribute: one reading of everything, as an ordinary client sees it.
#include <gmock/gmock.h>
#include <omniORB4/CORBA.h>

#include <chrono>
#include <numbers>

#include "config/load_profile.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "robot/corbot_robot.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class State : public RobotRig {
 protected:
  Corbot::ArmState read() {
    Corbot::ArmState_var now = arm_->State();
    return now.in();
  }
  /// By forward kinematics, of these joints.
  static ToolPose expected_tool(const Corbot::JointCoord& joints_deg) {
    static const ArmModel arm = load_profile(CORBOT_TEST_PROFILE).arm;
    Joints position_q{};
    for (CORBA::ULong i = 0; i < joints_deg.length(); ++i) position_q[i] = to_radians(joints_deg[i]);
    return tool_pose(arm.kinematics, position_q);
  }
  static void expect_same(const Corbot::Pose& pose, const ToolPose& tool) {
    EXPECT_NEAR(pose.position.x, tool.position_m[0], 1e-12);
    EXPECT_NEAR(pose.position.y, tool.position_m[1], 1e-12);
    EXPECT_NEAR(pose.position.z, tool.position_m[2], 1e-12);
    // The axes of the tool frame by the quaternion, and by yaw and pitch.
    const Corbot::Quaternion& q = pose.orientation;
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-12);
    EXPECT_GE(q.w, 0.0);
    const double cy = std::cos(tool.yaw_rad), sy = std::sin(tool.yaw_rad);
    const double cp = std::cos(tool.pitch_rad), sp = std::sin(tool.pitch_rad);
    EXPECT_NEAR(1.0 - 2.0 * (q.y * q.y + q.z * q.z), cy * cp, 1e-12) << "x axis: along the gripper";
    EXPECT_NEAR(2.0 * (q.x * q.y + q.w * q.z), sy * cp, 1e-12);
    EXPECT_NEAR(2.0 * (q.x * q.z - q.w * q.y), sp, 1e-12);
    EXPECT_NEAR(2.0 * (q.x * q.y - q.w * q.z), -sy, 1e-12) << "y axis: level";
    EXPECT_NEAR(1.0 - 2.0 * (q.x * q.x + q.z * q.z), cy, 1e-12);
  }
};

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

TEST_F(State, AtRestAgreesWithTheAttributes) {
  arm_->Move(0.20, 0.05, 0.08, 0.03, 0.0);
  arm_->Override(60.0);
  arm_->Open();
  const double before_s = seconds_since_1970();
  const Corbot::ArmState now = read();
  EXPECT_EQ(now.status, Corbot::Standby);
  EXPECT_GT(now.cycle, 0u);
  EXPECT_NEAR(now.time, before_s, 5.0);
  EXPECT_GE(now.age, 0.0);
  EXPECT_FALSE(now.paused);
  EXPECT_NEAR(now.overridePercent, 60.0, 1e-9);
  Corbot::JointCoord_var joints = arm_->ArtiCoord();
  ASSERT_EQ(now.commanded.length(), 4u);
  EXPECT_LT(distance_deg(now.commanded, joints), 1e-12);
  ASSERT_EQ(now.speeds.length(), 4u);
  for (CORBA::ULong i = 0; i < 4; ++i) EXPECT_EQ(now.speeds[i], 0.0);
  EXPECT_FALSE(now.measured);
  EXPECT_EQ(now.measuredJoints.length(), 0u);
  expect_same(now.tool, expected_tool(now.commanded));
  expect_same(now.toolCommanded, expected_tool(now.commanded));
  EXPECT_EQ(now.motion.id, 0u);
  EXPECT_EQ(now.queued, 0u);
  EXPECT_NEAR(now.gripper.commanded, 100.0, 1e-9);
  EXPECT_FALSE(now.gripper.measured);
  EXPECT_EQ(now.gripper.opening, now.gripper.commanded);
  EXPECT_EQ(now.gripper.holding, Corbot::HoldingUnknown) << "a servo says nothing";
  EXPECT_STREQ(now.device.backend, "loopback");
  EXPECT_EQ(now.device.health, Corbot::DeviceOpen);
  EXPECT_STREQ(now.control.holder, "");
  EXPECT_FALSE(now.control.held);
}

TEST_F(State, BelongsToOneCycleWhileTheArmMoves) {
  constexpr int kReadings = 20;
  arm_->Override(1.0);  // it moves for as long as is read
  const Corbot::Ticket first = arm_->StartMoveC({0.20, -0.03, 0.10}, {0.22, 0.0, 0.12}, {0.20, 0.03, 0.10});
  const Corbot::Ticket second = arm_->StartDelay(0.0);
  const double period_s = static_cast<double>(load_profile(profile_).arm.period_ns) * 1e-9;
  Corbot::ArmState last = read();
  int running = 0;
  const Deadline deadline = within(60);
  for (Corbot::ArmState now = last; now.status != Corbot::Standby; now = read()) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "the motion does not end";
    ASSERT_GE(now.cycle, last.cycle);
    ASSERT_GE(now.time - last.time, (static_cast<double>(now.cycle - last.cycle) - 0.5) * period_s)
        << "time and cycle are of one reading; a loop that is late leaves cycles out";
    expect_same(now.toolCommanded, expected_tool(now.commanded));
    ASSERT_NE(now.status, Corbot::Error);
    if (now.motion.id == first) {
      if (++running == kReadings) arm_->Override(100.0);
      EXPECT_EQ(now.status, Corbot::Waiting);
      EXPECT_EQ(now.motion.state, Corbot::MotionRunning);
      EXPECT_EQ(now.queued, 1u);
      if (last.motion.id == first) {
        EXPECT_GE(now.motion.progress, last.motion.progress);
      }
    }
    last = now;
  }
  EXPECT_GE(running, kReadings);
  EXPECT_EQ(read().queued, 0u);
  Corbot::MotionInfo_var end = arm_->Wait(second, 30.0);
  EXPECT_EQ(end->state, Corbot::MotionDone);
}

TEST_F(State, ShowsPauseHoldAndHolder) {
  arm_->Pause();
  EXPECT_TRUE(read().paused);
  EXPECT_EQ(read().status, Corbot::Waiting);
  const Corbot::Ticket ticket = arm_->StartDrive(0, 5.0, 20.0);
  EXPECT_TRUE(wait_until(within(30), [&] { return read().queued == 1; }));
  EXPECT_EQ(read().motion.id, 0u);
  arm_->Resume();
  EXPECT_FALSE(read().paused);
  Corbot::MotionInfo_var end = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(end->state, Corbot::MotionDone);

  Corbot::Arm_var mine = arm_->Acquire("cell 7", 30.0);
  const Corbot::ArmState held_by = read();
  EXPECT_STREQ(held_by.control.holder, "cell 7");
  EXPECT_GT(held_by.control.left, 20.0);
  EXPECT_LE(held_by.control.left, 30.0);
  mine->Release();
  EXPECT_STREQ(read().control.holder, "");

  arm_->StopAndHold();
  EXPECT_TRUE(read().control.held);
  EXPECT_EQ(read().status, Corbot::Error);
  arm_->Clear();
  EXPECT_FALSE(read().control.held);
}

TEST_F(State, IsErrorAndGrowsOldWithoutATask) {
  const CORBA::ULongLong cycle = read().cycle;
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  EXPECT_TRUE(wait_until(within(30), [&] { return read().status == Corbot::Error && read().age > 0.5; }));
  EXPECT_EQ(read().device.health, Corbot::DeviceClosed);
  EXPECT_GE(read().cycle, cycle);
  start_rt();
  EXPECT_TRUE(wait_until(within(30), [&] { return read().age < 0.1; }));
}

/// ORBit2 breaks on messages in fragments, which omniORB makes of what is larger than about 8 KB.
TEST(StateSize, IsFarBelowTheFragmentsOfAnOrb) {
  int argc = 0;
  const CORBA::ORB_var orb = CORBA::ORB_init(argc, nullptr);  // strings are marshalled by its code set
  const auto text = [](std::size_t room) { return std::string(room - 1, 'x'); };
  Corbot::ArmState all{};
  for (Corbot::JointCoord* joints : {&all.commanded, &all.speeds, &all.measuredJoints})
    joints->length(CORBOT_MAX_JOINTS);
  all.motion.reason = text(sizeof(corbot_motion_info::reason)).c_str();
  all.device.backend = text(sizeof(corbot_device_info::backend)).c_str();
  all.device.causeText = text(sizeof(corbot_device_info::cause_text)).c_str();
  all.control.holder = text(sizeof(corbot_holder::who)).c_str();
  cdrMemoryStream message;
  all >>= message;
  RecordProperty("octets", static_cast<int>(message.bufSize()));
  EXPECT_GT(message.bufSize(), 900u) << "with all of it";
  EXPECT_LT(message.bufSize(), 2048u);
}

}  // namespace
}  // namespace corbot::test
