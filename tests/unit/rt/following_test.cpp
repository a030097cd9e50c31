// SPDX-License-Identifier: Apache-2.0
// Set-points against what the device says: following errors, goals, the last set-point, a device that is too
// slow.
#include "rt/cycle/following_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "corbot/channel/alarms.h"
#include "rt/cycle_settings.h"
#include "rt/fault_fixture.h"
#include "support/paths.h"

namespace corbot::test::following_test {
namespace {

constexpr double kError_q = 0.2;
constexpr double kGoal_q = 0.02;

class Following : public FaultStops {
 protected:
  Following() {
    for (std::size_t i = 0; i < kMaxJoints; ++i) rig.settings.following[i] = {kError_q, 50'000'000, kGoal_q};
    rig.settings.settle_ns = 300'000'000;
    device.encoders = device.measures = true;
    begin_anew({.position_known = true});
  }
  /// Cycles until the verdict.
  int until_verdict(int most) {
    for (int i = 1; i <= most; ++i) {
      rig.step();
      if (const auto taken = rig.completion()) {
        verdict = taken->verdict;
        return i;
      }
    }
    return most + 1;
  }
  void be_without_encoders() {
    device.encoders = device.measures = false;
    device.feedback = {};
    begin_anew({.position_known = true});
  }
  Verdict verdict{};
};

TEST_F(Following, AJointThatIsTooFarForTooLongIsAFaultOnThePath) {
  go();
  rig.step(100);
  device.lag_q[1] = kError_q + 0.01;
  rig.step(49);
  device.lag_q[1] = 0.0;
  rig.step();
  device.lag_q[1] = -kError_q - 0.01;
  rig.step(50);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving) << "not for long enough, twice";
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kFollowingError);
  EXPECT_EQ(alarm::joint_deviation(*alarm).joint, 1);
  EXPECT_NEAR(alarm::joint_deviation(*alarm).error_q, -kError_q - 0.01, 1e-9);
  EXPECT_EQ(alarm::joint_deviation(*alarm).allowed_q, kError_q);
  EXPECT_TRUE(is_slowing_down());
  until_rest();
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_FALSE(rig.alarm()) << "once";
}

TEST_F(Following, AtRestAndWhenHeldToo) {
  device.lag_q[0] = kError_q + 0.01;
  rig.step(60);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kFollowingError);
  device.lag_q[0] = 0.0;
  rig.step(2);
  clear();
  ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.servant->control.hold_count.fetch_add(1);
  rig.step(2);
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  ASSERT_FALSE(device.frame.power_off);
  device.lag_q[0] = kError_q + 0.01;
  rig.step(60);
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(Following, ACycleWithoutAMeasurementDoesNotHideAJointThatIsTooFar) {
  for (int i = 0; i < 80; ++i) {
    device.measures = i % 5 != 4;
    if (!device.measures) device.feedback = {};
    device.lag_q[1] = kError_q + 0.01;
    rig.step();
  }
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kFollowingError);
}

TEST_F(Following, WhatIsNotANumberFollowsNothing) {
  device.lag_q[2] = std::numeric_limits<double>::quiet_NaN();
  rig.step(60);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kFollowingError);
}

TEST_F(Following, AGapOfTheCycleIsNoTimeOfTheJoints) {
  device.lag_q[0] = kError_q + 0.01;
  rig.step(10);
  rig.now_ns += 90'000'000;
  rig.step(5);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Following, WithoutEncodersNothingIsCompared) {
  be_without_encoders();
  device.feedback = {.commanded = true, .position_q = {1.0, 1.0, 1.0, 1.0}};
  rig.step(200);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Following, AMotionIsDoneWhenTheJointsAreThere) {
  const std::uint64_t id = go();
  device.lag_q[3] = kGoal_q + 0.001;
  const double duration_s = [&] {
    rig.step(2);
    return rig.snapshot.command_duration_s;
  }();
  const int cycles = static_cast<int>(duration_s * 1e3) + 100;
  EXPECT_EQ(until_verdict(cycles), cycles + 1) << "100 cycles too late, it is not there";
  EXPECT_EQ(rig.snapshot.command_id, id);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  device.lag_q[3] = kGoal_q - 0.001;
  EXPECT_EQ(until_verdict(1), 1);
  EXPECT_EQ(verdict, Verdict::kDone);
}

TEST_F(Following, EncodersThatSayNothingEndNoMotionAsDone) {
  go();
  rig.step(2);
  const int cycles = static_cast<int>(rig.snapshot.command_duration_s * 1e3) + 100;
  device.measures = false;
  device.feedback = {};
  EXPECT_EQ(until_verdict(cycles), cycles + 1) << "100 cycles at its end, and not known to be there";
  device.measures = true;
  EXPECT_LE(until_verdict(2), 2);
  EXPECT_EQ(verdict, Verdict::kDone);
}

TEST_F(Following, NorDoEncodersThatHaveSaidNothingSinceTheStart) {
  device.measures = false;
  device.feedback = {};
  begin_anew({.position_known = true});
  go();
  rig.step(2);
  const int cycles = static_cast<int>(rig.snapshot.command_duration_s * 1e3) + 100;
  EXPECT_EQ(until_verdict(cycles), cycles + 1) << "100 cycles at its end, and not known to be there";
  device.measures = true;
  EXPECT_LE(until_verdict(2), 2);
  EXPECT_EQ(verdict, Verdict::kDone);
}

TEST_F(Following, AGoalThatIsNotReachedIsAFault) {
  go();
  device.lag_q[3] = kGoal_q + 0.001;
  until_verdict(kLongestStop);
  EXPECT_EQ(verdict, Verdict::kFault);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kGoalNotReached);
  EXPECT_EQ(alarm::joint_deviation(*alarm).joint, 3);
  EXPECT_NEAR(alarm::joint_deviation(*alarm).error_q, kGoal_q + 0.001, 1e-9);
  rig.step();
  EXPECT_TRUE(device.frame.power_off) << "at rest already";
}

TEST_F(Following, AStopDoesNotWaitForTheJoints) {
  go();
  device.lag_q[3] = kGoal_q + 0.001;
  rig.step(2);
  while (rig.snapshot.virtual_time_s < rig.snapshot.command_duration_s) rig.step();
  rig.stop();
  EXPECT_EQ(until_verdict(2), 1);
  EXPECT_EQ(verdict, Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Following, WithoutEncodersItIsDoneWhenTheDeviceHasTheLastSetPoint) {
  be_without_encoders();
  go();
  rig.step(2);
  device.takes = false;
  const int cycles = static_cast<int>(rig.snapshot.command_duration_s * 1e3) + 100;
  EXPECT_EQ(until_verdict(cycles), cycles + 1);
  device.takes = true;
  EXPECT_EQ(until_verdict(1), 1);
  EXPECT_EQ(verdict, Verdict::kDone);
  rig.submit(rig.planner.gripper(rig.start(), 1.0));
  rig.step(2);
  device.takes = false;
  EXPECT_EQ(until_verdict(600), 601) << "the gripper takes half a second, and waits for the device too";
  device.takes = true;
  EXPECT_EQ(until_verdict(1), 1);
  EXPECT_EQ(verdict, Verdict::kDone);
}

TEST_F(Following, ALastSetPointThatIsNeverTakenIsNoSuccess) {
  be_without_encoders();
  go();
  rig.step(2);
  device.takes = false;
  until_verdict(kLongestStop);
  EXPECT_EQ(verdict, Verdict::kFault);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kGoalNotReached);
  EXPECT_EQ(alarm::joint_deviation(*alarm).joint, -1);
}

TEST_F(Following, AStopIsConfirmedWhenTheDeviceHasItsLastSetPoint) {
  const auto is_confirmed = [&] { return rig.snapshot.stops_done == rig.servant->control.stop_count; };
  for (const bool holds : {false, true}) {
    for (const bool grips : {false, true}) {
      SCOPED_TRACE(std::string(holds ? "hold" : "stop") + (grips ? " of the gripper" : " of the arm"));
      be_without_encoders();
      if (grips) {
        rig.submit(rig.planner.gripper(rig.start(), 1.0));
      } else {
        go();
      }
      rig.step(100);
      device.takes = false;
      if (holds) rig.servant->control.hold_count.fetch_add(1);
      rig.stop();
      rig.step(900);
      EXPECT_FALSE(is_confirmed()) << "later frames would move the arm";
      EXPECT_FALSE(rig.completion()) << "its caller finds the arm at rest, too";
      EXPECT_EQ(rig.snapshot.state, RtState::kStopping);
      device.takes = true;
      rig.step(2);
      EXPECT_TRUE(is_confirmed());
      EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
      EXPECT_EQ(rig.snapshot.state, holds ? RtState::kError : RtState::kStandby);
    }
  }
}

TEST_F(Following, AStopWhoseLastSetPointIsNeverTakenEndsAsAnError) {
  be_without_encoders();
  go();
  rig.step(100);
  device.takes = false;
  rig.stop();
  rig.step(kLongestStop);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.stops_done, rig.servant->control.stop_count) << "in Error";
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kGoalNotReached);
}

TEST_F(Following, AStopThatAFaultInterruptsCostsTheNextStopNoTime) {
  be_without_encoders();
  for (int i = 0; i < 3; ++i) {
    go(i % 2 == 0 ? kThere : Joints{});
    rig.step(100);
    device.takes = false;
    rig.stop();
    rig.step(900);
    press(true);
    rig.step();
    device.takes = true;
    press(false);
    rig.step(kLongestStop);
    clear();
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby) << i;
    while (const auto alarm = rig.alarm()) EXPECT_NE(alarm->code, AlarmCode::kGoalNotReached) << i;
  }
}

TEST_F(Following, AnOrderlyEndWaitsForNoDevice) {
  be_without_encoders();
  go();
  rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(100);
  device.takes = false;
  rig.stop();
  rig.cycle->begin_shutdown();
  int steps = 0;
  while (!rig.step().at_rest && steps < kLongestStop) ++steps;
  EXPECT_LT(steps, 500);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped) << "the queue has its verdicts in the same cycle";
  EXPECT_EQ(rig.snapshot.stops_done, rig.servant->control.stop_count);
}

TEST_F(Following, ADwellWaitsForNoDevice) {
  device.takes = false;
  rig.submit(rig.planner.dwell(rig.start(), 0.1));
  EXPECT_NEAR(until_verdict(200), 101, 1);
  EXPECT_EQ(verdict, Verdict::kDone);
}

TEST_F(Following, ADeviceThatIsTooSlowSlowsTheArmDownOnItsPath) {
  go();
  rig.step(50);
  device.times_now.speed_ratio = 0.5;
  rig.step(400);
  EXPECT_EQ(rig.snapshot.override_ratio, 0.5);
  EXPECT_EQ(rig.snapshot.virtual_rate, 0.5);
  device.times_now.speed_ratio = std::numeric_limits<double>::quiet_NaN();
  rig.step(2);
  EXPECT_EQ(rig.snapshot.override_ratio, 1.0);
  device.times_now.speed_ratio = 0.0;
  rig.step(2);
  EXPECT_EQ(rig.snapshot.override_ratio, 1.0 / 32) << "never a pause that nobody asked for";
}

TEST_F(FaultStops, AWatchingThreadThatStandsStillIsAPress) {
  rig.step(500);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby) << "nothing is watched by a thread of its own";
  rig.emergency_stop->beat();
  rig.step(100);
  rig.emergency_stop->beat();
  rig.step(100);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.stop_sources, static_cast<std::uint32_t>(StopSource::kWatcher));
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kEmergencyStop);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "still";
  rig.emergency_stop->beat();
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST(CycleSettings, AreThoseOfTheProfile) {
  Profile profile = load_profile(std::filesystem::path(CORBOT_PROFILES) / "lynx5.toml");
  profile.stop.category = 0;
  profile.settle_s = 2.5;
  profile.orphan_ns = 7;
  profile.following[1] = {.error_q = 0.3, .time_s = 0.2, .goal_q = 0.1};
  const rt::CycleSettings settings = rt::cycle_settings(profile);
  EXPECT_EQ(settings.stop_category, 0);
  EXPECT_EQ(settings.settle_ns, 2'500'000'000);
  EXPECT_EQ(settings.liveness.orphan_ns, 7);
  EXPECT_EQ(settings.liveness.gap_fault_ns, profile.gap_fault_ns);
  EXPECT_EQ(settings.following[1].error_q, 0.3);
  EXPECT_EQ(settings.following[1].time_ns, 200'000'000);
  EXPECT_EQ(settings.following[1].goal_q, 0.1);
}

}  // namespace
}  // namespace corbot::test::following_test
