// SPDX-License-Identifier: Apache-2.0
// A device whose thread stands still, and one that does late what it was asked to.
#include <gtest/gtest.h>

#include <vector>

#include "corbot/channel/alarms.h"
#include "rt/cycle/following_check.h"
#include "rt/cycle/position_check.h"
#include "rt/cycle/set_point_check.h"
#include "rt/fault_fixture.h"

namespace corbot::test::device_watch_test {
namespace {

constexpr int kStill_cycles = 3000;

class DeviceThread : public FaultStops {
 protected:
  DeviceThread() {
    device.has_thread = true;
    rig.step();
  }
};

TEST_F(DeviceThread, ThatStandsStillIsALostDevice) {
  const std::uint64_t id = go();
  rig.step(250);
  device.is_still = true;
  rig.step();
  rig.submit(rig.planner.dwell({kThere, 0.0}, 10.0));
  rig.step(kStill_cycles - 5);
  EXPECT_NE(rig.snapshot.state, RtState::kError) << "as long as a time-out of its own may take";
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kBackendLost);
  EXPECT_EQ(alarm::backend_cause(*alarm), DeviceCause::kThreadStill);
  EXPECT_EQ(rig.snapshot.device_cause, to_number(DeviceCause::kThreadStill));
  EXPECT_EQ(rig.snapshot.device_health, static_cast<std::uint32_t>(BackendHealth::kLost));
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_TRUE(device.frame.needs_clear);
  EXPECT_EQ(rig.completion()->id, id);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "it is still gone";
  device.is_still = false;
  rig.step(5);
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "nothing clears itself";
  EXPECT_FALSE(rig.alarm()) << "once";
  clear();
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(DeviceThread, ThatStandsStillWithTheWholeMachineIsNone) {
  rig.step(10);
  for (int i = 0; i < 20; ++i) {
    device.is_still = true;
    rig.now_ns += 90'000'000;  // a gap of the cycle, in which nobody ran
    rig.step(100);
    device.is_still = false;
    rig.step(2);
  }
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(DeviceThread, IsNotDemandedOfADeviceThatHasNone) {
  device.has_thread = false;
  device.beats_now = 0;
  rig.step(2 * kStill_cycles);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

class LateDevice : public FaultStops {
 protected:
  /// Pressed at rest, released and cleared, of which the device has taken nothing yet.
  void clear_unseen() {
    device.takes = false;
    press(true);
    rig.step();
    ASSERT_TRUE(device.frame.power_off);
    press(false);
    rig.step();
    clear();
    ASSERT_FALSE(device.frame.needs_clear);
    while (rig.alarm()) {
    }
  }
};

TEST_F(LateDevice, ThatTakesTheEnergyOffAfterTheClearIsNotLost) {
  clear_unseen();
  const std::uint64_t id = go();
  rig.step(10);
  EXPECT_EQ(rig.snapshot.command_id, 0u) << "the energy may still go";
  device.now = BackendHealth::kStandby;
  rig.step();
  EXPECT_NE(rig.snapshot.state, RtState::kError) << "it was asked to";
  EXPECT_FALSE(rig.alarm());
  device.takes = true;
  device.now = BackendHealth::kOpen;
  rig.step(3);
  EXPECT_EQ(rig.snapshot.command_id, id);
}

TEST_F(LateDevice, ThatHasTakenLaterFramesIsLostWhenItTakesTheEnergyOff) {
  clear_unseen();
  device.takes = true;
  rig.step(5);
  device.now = BackendHealth::kStandby;
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  ASSERT_EQ(rig.alarm()->code, AlarmCode::kBackendLost);
}

class MovingJoints : public FaultStops {
 protected:
  MovingJoints() {
    device.measures = device.encoders = true;
    for (rt::FollowingLimit& limit : rig.settings.following) limit = {1.0, 50'000'000, 0.01};
    begin_anew({.position_known = true});
  }
  /// At the end of a motion's set-points, one joint on its way.
  void come_to_the_end() {
    go();
    rig.step(2);
    device.lag_q[0] = 0.2;
    while (rig.snapshot.virtual_time_s < rig.snapshot.command_duration_s) rig.step();
    rig.step(2);
    ASSERT_NE(rig.snapshot.command_id, 0u) << "it is awaited";
  }
};

TEST_F(MovingJoints, KeepTheirEnergyWhenPressedUntilTheyRest) {
  come_to_the_end();
  press(true);
  int cycles = 0;
  for (; device.lag_q[0] > 0.0; device.lag_q[0] -= 0.001, ++cycles) {
    rig.step();
    ASSERT_EQ(rig.snapshot.state, RtState::kError);
    ASSERT_FALSE(device.frame.power_off) << cycles;
    ASSERT_TRUE(is_slowing_down());
  }
  rig.step(60);
  EXPECT_TRUE(device.frame.power_off) << "they rest";
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
}

TEST_F(MovingJoints, ThatDoNotComeToRestAreAwaitedForTheTimeOfARamp) {
  come_to_the_end();
  press(true);
  int cycles = 0;
  for (; !device.frame.power_off && cycles < 2000; ++cycles) {
    device.lag_q[0] = cycles % 2 == 0 ? 0.1 : 0.2;
    rig.step();
  }
  EXPECT_NEAR(cycles, 1000, 5);
}

TEST_F(MovingJoints, LoseTheirEnergyAtOnceInCategory0) {
  rig.settings.stop_category = 0;
  begin_anew({.position_known = true});
  come_to_the_end();
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
}

/// The usual order of a hurried hand: what ends the motion first, then the button, the joints still on their
/// way.
class EndedMotion : public MovingJoints {
 protected:
  enum class By { kStop, kCancel, kHold, kOrphan };

  void end_motion(By by) {
    const std::uint64_t id = go();
    rig.step(250);
    ASSERT_EQ(rig.snapshot.command_id, id);
    device.lag_q[0] = 0.2;
    if (by == By::kHold) rig.servant->control.hold_count.fetch_add(1);
    if (by == By::kHold || by == By::kStop) rig.stop();
    if (by == By::kCancel) rig.cancel(id, id);
    if (by == By::kOrphan) rig.servant_responds = false;
    until_rest();
    for (int i = 0; i < 10; ++i) {
      device.lag_q[0] -= 0.001;
      rig.step();
    }
  }
  void press_after(By by) {
    end_motion(by);
    press(true);
    for (int i = 0; device.lag_q[0] > 0.0; device.lag_q[0] -= 0.001, ++i) {
      rig.step();
      ASSERT_EQ(rig.snapshot.state, RtState::kError);
      ASSERT_FALSE(device.frame.power_off) << i;
      ASSERT_TRUE(is_slowing_down());
    }
    rig.step(60);
    EXPECT_TRUE(device.frame.power_off) << "they rest";
    EXPECT_FALSE(is_slowing_down());
  }
};

TEST_F(EndedMotion, ByAStopThePressAwaitsTheJoints) { press_after(By::kStop); }
TEST_F(EndedMotion, ByACancelThePressAwaitsTheJoints) { press_after(By::kCancel); }
TEST_F(EndedMotion, ByAHoldThePressAwaitsTheJoints) { press_after(By::kHold); }
TEST_F(EndedMotion, WithoutAServantThePressAwaitsTheJoints) {
  rig.settings.liveness.orphan_ns = 50'000'000;
  begin_anew({.position_known = true});
  press_after(By::kOrphan);
}

TEST_F(EndedMotion, JointsThatDoNotComeToRestAreAwaitedForTheTimeOfARamp) {
  end_motion(By::kStop);
  press(true);
  int cycles = 0;
  for (; !device.frame.power_off && cycles < 2000; ++cycles) {
    device.lag_q[0] = cycles % 2 == 0 ? 0.1 : 0.2;
    rig.step();
  }
  EXPECT_NEAR(cycles, 1000, 5);
}

TEST_F(EndedMotion, JointsAtRestLoseTheirEnergyInTheCycleOfThePress) {
  end_motion(By::kStop);
  rig.step(60);
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(EndedMotion, InCategory0TheEnergyGoesAtOnce) {
  rig.settings.stop_category = 0;
  begin_anew({.position_known = true});
  end_motion(By::kStop);
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(EndedMotion, OfADeviceWithoutEncodersTheEnergyGoesAtOnce) {
  device.measures = device.encoders = false;
  device.feedback = {};
  begin_anew({.position_known = true});
  end_motion(By::kStop);
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(EndedMotion, AShutdownAwaitsTheJointsOfAPress) {
  end_motion(By::kStop);
  press(true);
  rig.step();
  rig.cycle->begin_shutdown();
  EXPECT_FALSE(rig.step().at_rest);
  rig.step(60);
  EXPECT_TRUE(rig.step().at_rest);
  EXPECT_TRUE(device.frame.power_off);
}

/// Nothing gets energy before a Clear: joints that sag without it are no reason for any.
TEST_F(EndedMotion, JointsThatSagGetNoEnergyFromAnotherPress) {
  end_motion(By::kStop);
  rig.step(60);
  press(true);
  rig.step();
  ASSERT_TRUE(device.frame.power_off);
  for (int i = 0; i < 200; ++i) {
    device.lag_q[0] += 0.004;
    if (i == 100) rig.emergency_stop->set(StopSource::kDevice, true);
    rig.step();
    ASSERT_TRUE(device.frame.power_off) << i;
  }
}

/// A device's thread that blocks in a call renews nothing: that says nothing of the joints.
TEST(RestCheck, ARecordThatIsNotRenewedIsNoRest) {
  rt::RestCheck rest;
  ServoFeedback feedback{.measured = true, .time_ns = 1'000'000, .position_q = {0.5}};
  for (int i = 0; i < 1000; ++i) rest.see(feedback, 1'000'000);
  EXPECT_FALSE(rest.is_at_rest());
  feedback.position_q[0] += 0.1;
  feedback.time_ns += 1'000'000'000;
  rest.see(feedback, 1'000'000);
  EXPECT_FALSE(rest.is_at_rest()) << "it has moved meanwhile";
}

TEST(RestCheck, RecordsThatComeSlowlyCountForTheTimeBetweenThem) {
  rt::RestCheck rest;
  ServoFeedback feedback{.measured = true, .position_q = {0.5}};
  int cycles = 0;
  for (; !rest.is_at_rest() && cycles < 1000; ++cycles) {
    if (cycles % 10 == 0) feedback.time_ns += 10'000'000;
    rest.see(feedback, 1'000'000);
  }
  EXPECT_EQ(cycles, 51);
}

/// Near is for a joint that slides what the end of a link of 0.3 m moves by: 2 mrad are 0.6 mm.
TEST(RestCheck, AJointThatSlidesRestsWithinLess) {
  rt::RestCheck rest({JointKind::kPrismatic});
  ServoFeedback feedback{.measured = true, .position_q = {0.5}};
  const auto run = [&](double step_m) {
    for (int i = 0; i < 100; ++i) {
      feedback.position_q[0] += i % 2 == 0 ? step_m : -step_m;
      feedback.time_ns += 1'000'000;
      rest.see(feedback, 1'000'000);
    }
    return rest.is_at_rest();
  };
  EXPECT_FALSE(run(0.001));
  EXPECT_TRUE(run(0.0005));
}

TEST(PositionCheck, AJointThatSlidesVerifiesByLess) {
  rt::PositionCheck check({JointKind::kPrismatic});
  check.begin(true, false);
  check.motion_done({}, {0.002});
  EXPECT_TRUE(check.is_unverified());
  check.motion_done({}, {0.004});
  EXPECT_FALSE(check.is_unverified()) << "0.01 rad are 3 mm";
}

TEST(BeyondRange, OfAJointThatSlidesIsFiveMillimetresForADegree) {
  ArmModel arm;
  arm.dof = 1;
  JointChain chain;
  chain.count = 1;
  chain.axes[0].kind = JointKind::kPrismatic;
  chain.axes[0].direction = {0.0, 0.0, 1.0};
  arm.kinematics = Kinematics::recognise(chain);
  arm.joints[0] = {0.0, 0.5, 0.1, 1.0, 10.0};
  EXPECT_FALSE(rt::beyond_range(arm, {0.505}, to_radians(1.0)));
  EXPECT_TRUE(rt::beyond_range(arm, {0.506}, to_radians(1.0)));
  EXPECT_TRUE(rt::beyond_range(arm, {-0.006}, to_radians(1.0)));
}

}  // namespace
}  // namespace corbot::test::device_watch_test
