// SPDX-License-Identifier: Apache-2.0
// A device that gives the servos no energy until a Clear.
#include <gtest/gtest.h>

#include <limits>

#include "corbot/channel/alarms.h"
#include "rt/fault_fixture.h"

namespace corbot::test::standby_test {
namespace {

class StandsBy : public FaultStops {
 protected:
  StandsBy() { device.stands_by = true; }
  /// Pressed at rest or in motion, released, and standing by.
  void lose_energy() {
    press(true);
    rig.step();
    until_rest();
    rig.step();
    ASSERT_EQ(device.now, BackendHealth::kStandby);
    press(false);
    rig.step();
  }
};

TEST_F(StandsBy, TheSetPointFollowsTheServosAndNothingMovesByItself) {
  lose_energy();
  device.feedback = {.measured = true, .position_q = {0.3, -0.2, 0.1, 0.0}};
  rig.step(2);
  EXPECT_EQ(rig.snapshot.position_q, device.feedback.position_q);
  EXPECT_EQ(device.frame.position_q, device.feedback.position_q);
  EXPECT_EQ(rig.snapshot.velocity_q_s, Joints{}) << "no set-point has moved";
  device.feedback.position_q[1] = 100.0;
  device.feedback.position_q[2] = std::numeric_limits<double>::quiet_NaN();
  rig.step(2);
  EXPECT_EQ(rig.snapshot.position_q[1], rig.arm.joints[1].upper_q);
  EXPECT_EQ(rig.snapshot.position_q[2], 0.1);
  device.feedback.position_q = {0.2, -0.1, 0.1, 0.0};
  rig.step(2);
  const Joints at_clear = rig.snapshot.position_q;
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving) << "the servos are being energised";
  EXPECT_FALSE(device.frame.needs_clear);
  device.feedback = {};  // while they are being enabled nothing is said
  rig.step(10);
  EXPECT_EQ(device.frame.position_q, at_clear);
  device.feedback = {.measured = true, .position_q = {0.2, 0.5, 0.1, 0.0}};  // turned before its turn
  rig.step(2);
  const Joints energised_at = device.feedback.position_q;
  EXPECT_EQ(device.frame.position_q, energised_at) << "it is held where it got its energy";
  EXPECT_EQ(rig.snapshot.velocity_q_s, Joints{});
  device.now = BackendHealth::kOpen;
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  device.feedback.position_q[1] = 0.4;
  rig.step(2);
  EXPECT_EQ(device.frame.position_q, energised_at) << "an open device follows, and does not lead";
}

TEST_F(StandsBy, AJointThatIsTurnedBeyondItsRangeAfterAClearEndsInError) {
  lose_energy();
  device.feedback = {.measured = true, .position_q = {0.3, -0.2, 0.1, 0.0}};
  rig.step(2);
  clear();
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  while (rig.alarm()) {
  }
  device.feedback.position_q[1] = rig.arm.joints[1].upper_q + 0.1;
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.needs_clear && device.frame.power_off);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kJointBeyondRange);
  EXPECT_EQ(alarm->joint, 1);
}

/// Another client's, that is read in the cycle that finds the joint there.
TEST_F(StandsBy, AClearInTheCycleThatFindsAJointBeyondItsRangeRaisesNothingMore) {
  lose_energy();
  device.feedback = {.measured = true, .position_q = {0.3, -0.2, 0.1, 0.0}};
  rig.step(2);
  clear();
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  device.feedback.position_q[1] = rig.arm.joints[1].upper_q + 0.1;
  rig.step();  // from here the cycle knows it
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  while (rig.alarm()) {
  }
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.needs_clear && device.frame.power_off);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kJointBeyondRange);
  EXPECT_FALSE(rig.alarm()) << "said twice";
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(rig.alarm()) << "the next Clear has its answer";
}

/// The next task is to find the press, too.
TEST_F(StandsBy, ARefusedClearChangesNothing) {
  lose_energy();
  rig.task->stop_seen = 1;
  device.feedback = {.measured = true, .position_q = {0.3, rig.arm.joints[1].upper_q + 0.1, 0.1, 0.0}};
  rig.step(2);
  clear();
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.task->stop_seen.load(), 1u) << "a joint is beyond its range";
  device.feedback.position_q[1] = 0.0;
  device.now = BackendHealth::kLost;
  rig.step(2);
  clear();
  EXPECT_EQ(rig.task->stop_seen.load(), 1u) << "the device is lost";
  device.now = BackendHealth::kStandby;
  rig.step(2);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  EXPECT_EQ(rig.task->stop_seen.load(), 0u);
}

TEST_F(StandsBy, TheGripperStaysWhereItWasPushed) {
  lose_energy();
  device.feedback = {.measured = true, .opening = 0.25};
  rig.step(2);
  EXPECT_EQ(rig.snapshot.gripper, 0.25);
  const double pulse_us = device.frame.pulse_us[rig.arm.dof];
  device.feedback.opening = std::numeric_limits<double>::quiet_NaN();
  rig.step(2);
  device.feedback.opening = -1.0;
  rig.step(2);
  EXPECT_EQ(rig.snapshot.gripper, 0.25) << "what is not reported";
  clear();
  device.now = BackendHealth::kOpen;
  device.feedback.opening = 0.9;
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_EQ(device.frame.pulse_us[rig.arm.dof], pulse_us);
}

/// The set-point begins within the range: a Clear would drive it back there.
TEST_F(StandsBy, AJointThatIsBeyondItsRangeIsNotBroughtBackByAClear) {
  for (const bool measured : {true, false}) {
    lose_energy();
    while (rig.alarm()) {
    }
    const double upper_q = rig.arm.joints[1].upper_q;
    const ServoFeedback beyond = {
        .measured = measured, .commanded = !measured, .position_q = {0.3, upper_q + 0.1, 0.1, 0.0}};
    device.feedback = beyond;
    rig.step(2);
    clear();
    EXPECT_EQ(rig.snapshot.state, RtState::kError);
    EXPECT_TRUE(device.frame.needs_clear && device.frame.power_off);
    EXPECT_EQ(rig.snapshot.clears_done, rig.servant->control.clear_count.load()) << "it has its answer";
    const auto alarm = rig.alarm();
    ASSERT_TRUE(alarm);
    EXPECT_EQ(alarm->code, AlarmCode::kJointBeyondRange);
    EXPECT_EQ(alarm->joint, 1);
    EXPECT_EQ(alarm::out_of_range(*alarm).position_q, upper_q + 0.1);
    EXPECT_EQ(alarm::out_of_range(*alarm).lower_q, rig.arm.joints[1].lower_q);
    EXPECT_EQ(alarm::out_of_range(*alarm).upper_q, upper_q);
    device.feedback = {};  // an answer is missing
    rig.step(2);
    clear();
    EXPECT_EQ(rig.snapshot.state, RtState::kError) << "it has not come back since";
    device.feedback = beyond;
    device.feedback.position_q[1] = -std::numeric_limits<double>::infinity();
    rig.step(2);
    clear();
    EXPECT_EQ(rig.snapshot.state, RtState::kError);
    device.feedback.position_q[1] = upper_q - 0.1;  // turned back by hand
    rig.step(2);
    clear();
    EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
    EXPECT_FALSE(device.frame.needs_clear);
    EXPECT_EQ(device.frame.position_q, device.feedback.position_q);
    device.now = BackendHealth::kOpen;
    rig.step(2);
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
  }
}

TEST_F(StandsBy, WhatIsHardlyBeyondItsRangeIsAtItsEnd) {
  lose_energy();
  device.feedback = {.measured = true, .position_q = {0.3, rig.arm.joints[1].upper_q + 0.015, 0.1, 0.0}};
  rig.step(2);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  EXPECT_EQ(device.frame.position_q[1], rig.arm.joints[1].upper_q);
}

/// One that follows its set-points holds the joint where it is: nothing moves at a Clear.
TEST_F(FaultStops, AHeldJointThatHangsBeyondItsEndIsCleared) {
  device.feedback = {.measured = true, .position_q = {0.0, rig.arm.joints[1].upper_q + 0.1, 0.0, 0.0}};
  rig.servant->control.hold_count = 1;
  rig.stop();
  rig.step(5);
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

/// As a hold: the next task finds it in the file of the position.
TEST_F(StandsBy, AnErrorOutlivesEveryProcessByTheFileOnDisk) {
  begin_anew({.in_error = true});
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.needs_clear && device.frame.power_off);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kErrorInherited);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  device.now = BackendHealth::kOpen;
  rig.step(2);
  ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.restart({.in_error = true});
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby) << "the segment is newer";
}

TEST_F(StandsBy, PulsesAreFollowedToo) {
  lose_energy();
  device.feedback = {.commanded = true, .position_q = {0.3, -0.2, 0.1, 0.0}};
  rig.step(2);
  EXPECT_EQ(rig.snapshot.position_q, device.feedback.position_q);
  EXPECT_EQ(rig.snapshot.flags & kSnapshotMeasured, 0u);
}

TEST_F(StandsBy, AClearInItsFirstCycleHoldsTheServosWhereTheyAre) {
  device.now = BackendHealth::kLost;
  rig.step(2);
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  device.now = BackendHealth::kStandby;
  device.feedback = {.commanded = true, .position_q = {0.3, -0.2, 0.1, 0.0}};
  rig.step();
  clear();
  EXPECT_FALSE(device.frame.needs_clear);
  EXPECT_EQ(device.frame.position_q, device.feedback.position_q);
}

TEST_F(StandsBy, NoCommandBeginsBeforeTheServosAreThere) {
  lose_energy();
  clear();
  const std::uint64_t id = go();
  rig.step(100);
  EXPECT_EQ(rig.snapshot.command_id, 0u);
  EXPECT_FALSE(rig.completion());
  device.now = BackendHealth::kOpen;
  rig.step(2);
  EXPECT_EQ(rig.snapshot.command_id, id);
}

TEST_F(StandsBy, AStopEndsTheWayThere) {
  lose_energy();
  device.feedback = {.commanded = true, .position_q = {}};
  rig.step(2);
  clear();
  device.feedback.position_q[0] = 0.2;
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.0) << "the way goes on to where it is held";
  rig.stop();
  rig.step();
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(device.frame.position_q[0], 0.2) << "here it stays";
}

/// The reply to a Stop between two reports of the device is the next of them.
TEST_F(StandsBy, AStopBeforeTheFirstReportEndsTheWayAtIt) {
  lose_energy();
  device.feedback = {};
  clear();
  rig.stop();
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.0);
  device.feedback = {.commanded = true, .position_q = {0.2, 0.0, 0.0, 0.0}};
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.2);
  device.feedback.position_q[0] = 0.1;
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.2) << "the servos go back to it, and it does not follow them";
}

TEST_F(StandsBy, ASecondClearDoesNotTakeBackAStop) {
  lose_energy();
  device.feedback = {};
  clear();
  rig.stop();
  rig.step();
  clear();
  device.feedback = {.commanded = true, .position_q = {0.2, 0.0, 0.0, 0.0}};
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.2);
}

TEST_F(StandsBy, AClearForgetsAStopOfAnEarlierOne) {
  lose_energy();
  device.feedback = {};
  clear();
  rig.stop();
  rig.step();
  press(true);
  rig.step();
  press(false);
  rig.step();
  clear();
  device.feedback = {.commanded = true, .position_q = {0.2, 0.0, 0.0, 0.0}};
  rig.step(2);
  EXPECT_EQ(device.frame.position_q[0], 0.0);
}

TEST_F(StandsBy, APressOnTheWayThereTakesTheEnergyOffAgain) {
  lose_energy();
  clear();
  press(true);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_TRUE(device.frame.needs_clear);
}

TEST_F(StandsBy, AFailureOnTheWayThereIsALostDevice) {
  lose_energy();
  while (rig.alarm()) {
  }
  clear();
  device.now = BackendHealth::kLost;
  device.why = DeviceCause::kTorqueOff;
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kCleared);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kBackendLost);
}

TEST_F(StandsBy, WithoutBeingAskedIsALostDevice) {
  go();
  rig.step(250);
  device.now = BackendHealth::kStandby;
  device.why = DeviceCause::kDisabled;
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kBackendLost);
  EXPECT_EQ(alarm::backend_cause(*alarm), DeviceCause::kDisabled);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
}

TEST_F(StandsBy, AStartInErrorStandsByWithoutAnAlarmOfTheDevice) {
  lose_energy();
  while (rig.alarm()) {
  }
  rig.restart();
  rig.step(3);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kErrorInherited);
  EXPECT_FALSE(rig.alarm());
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
}

TEST_F(FaultStops, AMeasuringDeviceThatCannotTellIsFollowedBeyondItsLagOnly) {
  device.measures = true;
  begin_anew({});
  press(true);
  rig.step(2);
  device.measures = false;
  device.feedback.position_q = {0.01, 0.3, 0.0, 0.0};
  rig.step(2);
  EXPECT_EQ(rig.snapshot.position_q, (Joints{0.0, 0.3, 0.0, 0.0}))
      << "the first hangs behind, the second has fallen";
}

}  // namespace
}  // namespace corbot::test::standby_test
