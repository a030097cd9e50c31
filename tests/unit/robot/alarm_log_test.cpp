// SPDX-License-Identifier: Apache-2.0
#include "robot/alarm_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "corbot/channel/alarms.h"

namespace corbot::alarm_log_test {
namespace {

AlarmEvent event(AlarmCode code) { return {code, 2, 1'700'000'000'000'000'000, 0.5, -0.1, 0.1}; }

TEST(AlarmLog, NamesJointValueAndLimit) {
  AlarmLog log;
  log.add(event(AlarmCode::kSetPointOutOfRange));
  const auto list = log.list();
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].code, 101);
  EXPECT_TRUE(list[0].active);
  EXPECT_DOUBLE_EQ(list[0].time_s, 1.7e9);
  EXPECT_NE(list[0].text.find("joint 2"), std::string::npos) << list[0].text;
  EXPECT_NE(list[0].text.find("28.648"), std::string::npos) << list[0].text;
}

TEST(AlarmLog, EveryCodeHasAText) {
  for (const AlarmCode code : {AlarmCode::kSetPointNotFinite,
                               AlarmCode::kSetPointOutOfRange,
                               AlarmCode::kSetPointDiscontinuous,
                               AlarmCode::kSetPointTooQuick,
                               AlarmCode::kSetPointOutsideWorkspace,
                               AlarmCode::kKinematicsFailed,
                               AlarmCode::kFollowingError,
                               AlarmCode::kGoalNotReached,
                               AlarmCode::kJointBeyondRange,
                               AlarmCode::kCommandRefused,
                               AlarmCode::kRingCorrupt,
                               AlarmCode::kBackendDegraded,
                               AlarmCode::kBackendLost,
                               AlarmCode::kEmergencyStop,
                               AlarmCode::kErrorInherited,
                               AlarmCode::kHeld,
                               AlarmCode::kOverrun,
                               AlarmCode::kLoopGap,
                               AlarmCode::kTaskReplaced,
                               AlarmCode::kServantSilent}) {
    AlarmLog log;
    log.add(event(code));
    EXPECT_EQ(log.list()[0].text.find("alarm "), std::string::npos) << log.list()[0].text;
  }
  AlarmLog log;
  log.add(event(static_cast<AlarmCode>(999)));
  EXPECT_EQ(log.list()[0].text, "alarm 999");
}

TEST(AlarmLog, OnlyAFaultIsTheCauseOfError) {
  EXPECT_TRUE(causes_error(AlarmCode::kBackendLost));
  EXPECT_FALSE(causes_error(AlarmCode::kBackendDegraded));
  EXPECT_EQ(alarm_text(alarm::backend_lost(DeviceCause::kHungUp), {}),
            "the servo device is lost: the line was cut; set-points are held");
}

TEST(AlarmLog, ANumberThatIsNoCauseOfADeviceHasNoText) {
  // docs/alarms.md: the causes are numbered from 1 without a gap.
  std::uint32_t number = 1;
  for (; to_device_cause(number) != DeviceCause::kNone; ++number) {
    EXPECT_EQ(to_number(to_device_cause(number)), number);
    EXPECT_STRNE(device_cause_text(to_device_cause(number)), "") << number;
  }
  EXPECT_EQ(number, to_number(DeviceCause::kNoSetpoint) + 1);
  for (; number < 1000; ++number) EXPECT_EQ(to_device_cause(number), DeviceCause::kNone) << number;
  EXPECT_EQ(to_device_cause(~std::uint32_t{0}), DeviceCause::kNone);
  AlarmEvent lost = alarm::backend_lost(DeviceCause::kNone);
  lost.value = 1000.0;
  EXPECT_EQ(alarm_text(lost, {}), "the servo device is lost; set-points are held");
}

TEST(AlarmLog, TheNewestActiveOneIsTheCause) {
  AlarmLog log;
  EXPECT_EQ(log.cause(), "");
  log.add(event(AlarmCode::kBackendLost));
  log.add(event(AlarmCode::kOverrun));  // causes no Error
  EXPECT_NE(log.cause().find("device"), std::string::npos);
  log.deactivate();
  EXPECT_EQ(log.cause(), "");
}

TEST(AlarmLog, AClearDoesNotBringALostTaskBack) {
  AlarmLog log;
  log.add(kAlarmTaskGone, true, "gone");
  log.deactivate();
  EXPECT_EQ(log.cause(), "gone");
  log.deactivate(kAlarmTaskGone);
  EXPECT_EQ(log.cause(), "");
}

TEST(AlarmLog, KeepsTheLast64) {
  AlarmLog log;
  for (int i = 0; i < 100; ++i) log.add(i, false, std::to_string(i));
  const auto list = log.list();
  ASSERT_EQ(list.size(), 64u);
  EXPECT_EQ(list.front().text, "36");
  EXPECT_EQ(list.back().text, "99");
}

TEST(AlarmLog, AnActiveOneIsNeverPushedOut) {
  AlarmLog log;
  log.add(event(AlarmCode::kBackendLost));
  for (int i = 0; i < 200; ++i) log.add(i, false, std::to_string(i));
  const auto list = log.list();
  ASSERT_EQ(list.size(), 64u);
  EXPECT_EQ(list.front().code, 121);
  EXPECT_TRUE(list.front().active);
  EXPECT_EQ(list.back().text, "199");
  EXPECT_NE(log.cause(), "");
}

TEST(AlarmLog, OfManyActiveOnesEachCodeIsKept) {
  AlarmLog log;
  log.add(event(AlarmCode::kEmergencyStop));
  for (int i = 0; i < 200; ++i) log.add(event(AlarmCode::kBackendLost));
  const auto list = log.list();
  ASSERT_EQ(list.size(), 64u);
  EXPECT_EQ(list.front().code, 130);
  EXPECT_EQ(list.back().code, 121);
}

TEST(AlarmText, ReadsWhatTheConstructorsWrite) {
  EXPECT_EQ(alarm_text(alarm::command_refused({17, Verdict::kLimit, 2, 0.5}), {}),
            "the real-time task refused command 17 (verdict 6, value 0.5)");
  EXPECT_EQ(alarm_text(alarm::kinematics_failed({0.25, 2.0}), {}),
            "path and kinematics disagree at 0.250 s of 2.000 s; the arm is brought to rest");
  EXPECT_EQ(alarm_text(alarm::set_point_discontinuous({1, -0.1, 0.05}), {}),
            "set-point of joint 1 would step by -5.7296 degrees in a cycle, limit 2.8648; the arm is brought "
            "to rest");
  EXPECT_EQ(
      alarm_text(alarm::set_point_too_quick({1, 3, -0.5, 0.25}), {}),
      "set-points of joint 1 would have a jerk of -28.65 degrees/s³, limit 14.32; the arm is brought to "
      "rest");
  EXPECT_EQ(alarm_text(alarm::set_point_out_of_range({-1, 1.2, 0.0, 1.0}), {}),
            "set-point of the gripper at 1.200 is out of range 0.000 to 1.000; the arm is brought to rest");
}

TEST(AlarmText, NamesThePartThatLeavesTheWorkspace) {
  EXPECT_EQ(alarm_text(alarm::set_point_outside_workspace({1, 2, -0.0125, 0.0}), {}),
            "a set-point would put the elbow 12.5 mm beyond plane or box 2 of the workspace, "
            "limit 0 mm; the arm is brought to rest");
}

TEST(AlarmText, NamesThePlaneOrBoxOfTheProfile) {
  AlarmLog log({}, {"floor", "post"});
  log.add(alarm::set_point_outside_workspace({1, 2, -0.0125, 0.0}));
  log.add(alarm::set_point_outside_workspace({2, 2, -0.0125, 0.0}));
  const std::vector<AlarmEntry> all = log.list();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_THAT(all[0].text, testing::HasSubstr("12.5 mm beyond 'post', limit 0 mm"));
  EXPECT_THAT(all[1].text, testing::HasSubstr("beyond plane or box 3 of the workspace"));
}

TEST(AlarmText, SaysWhatCountsAsAPress) {
  EXPECT_EQ(alarm_text(alarm::emergency_stop(0), {}), "emergency stop");
  EXPECT_EQ(alarm_text(alarm::emergency_stop(3), {}), "emergency stop");
  EXPECT_EQ(alarm_text(alarm::emergency_stop(4), {}), "emergency stop: the line cannot be read");
  EXPECT_EQ(alarm_text(alarm::emergency_stop(8 + 32), {}),
            "emergency stop: the device does not say how its input is, no thread watches the input");
  EXPECT_EQ(alarm_text(alarm::emergency_stop(16 + 64), {}),
            "emergency stop: the watchdog output has tripped");
}

TEST(AlarmText, OfAGoalNamesTheJointOrTheDevice) {
  EXPECT_EQ(alarm_text(alarm::goal_not_reached({1, 0.1, 0.05}), {}),
            "joint 1 has not reached its goal: it is 5.730 degrees away, 2.865 are allowed");
  EXPECT_EQ(alarm_text(alarm::goal_not_reached({-1, 0.0, 0.0}), {}),
            "the servo device has not taken a motion's last set-point");
  EXPECT_EQ(alarm_text(alarm::following_error({0, -0.2, 0.1}), {}),
            "joint 0 is -11.459 degrees from its set-point, 5.730 are allowed");
}

TEST(AlarmText, GarbageInARecordIsNoFault) {
  AlarmEvent event = alarm::command_refused({1, Verdict::kLimit, 0, 0.0});
  event.value = -1e300;
  event.lower = 1e300;
  EXPECT_EQ(alarm::refused_command(event).id, 0u);
  for (const double garbage : {1e300, -1.0, 0.0, 11.0, 999999.0}) {
    event.lower = garbage;
    EXPECT_EQ(alarm::refused_command(event).verdict, Verdict::kMalformed) << garbage;
  }
  event.lower = 5.0;
  EXPECT_EQ(alarm::refused_command(event).verdict, Verdict::kDiscontinuous);
}

TEST(AlarmText, JointsThatSlideAreInMetres) {
  const JointKinds kinds{JointKind::kRotary, JointKind::kPrismatic};
  EXPECT_EQ(alarm_text(alarm::following_error({1, -0.03, 0.02}), kinds),
            "joint 1 is -0.030000 m from its set-point, 0.020000 are allowed");
  EXPECT_EQ(alarm_text(alarm::goal_not_reached({1, 0.002, 0.001}), kinds),
            "joint 1 has not reached its goal: it is 0.002000 m away, 0.001000 are allowed");
  EXPECT_EQ(
      alarm_text(alarm::set_point_out_of_range({1, 0.25, -0.1, 0.2}), kinds),
      "set-point of joint 1 at 0.250000 m is out of range -0.100000 to 0.200000; the arm is brought to rest");
  EXPECT_EQ(alarm_text(alarm::set_point_discontinuous({1, 0.001, 0.0005}), kinds),
            "set-point of joint 1 would step by 0.0010000 m in a cycle, limit 0.0005000; the arm is brought "
            "to rest");
  EXPECT_EQ(
      alarm_text(alarm::joint_beyond_range({1, 0.21, 0.0, 0.2}), kinds),
      "joint 1 is at 0.2100 m, outside its range of 0.0000 to 0.2000: nothing moves by itself; push it back "
      "by hand");
  EXPECT_EQ(alarm_text(alarm::following_error({7, -0.2, 0.1}), kinds),
            "joint 7 is -11.459 degrees from its set-point, 5.730 are allowed")
      << "a joint that nobody has";
}

}  // namespace
}  // namespace corbot::alarm_log_test
