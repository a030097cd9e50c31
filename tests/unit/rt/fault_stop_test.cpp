// SPDX-License-Identifier: Apache-2.0
// Tests what a fault does to the arm and to the servos' power, by its cause, and what Clear restores.
#include "rt/cycle/fault_stop.h"

#include <gtest/gtest.h>

#include <vector>

#include "rt/fault_fixture.h"

namespace corbot::test::fault_stop_test {
namespace {

TEST_F(FaultStops, AStopInputSlowsDownAndThenTakesTheEnergyOff) {
  const std::uint64_t running = go();
  const std::uint64_t waiting = rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  press(true);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(is_slowing_down());
  EXPECT_TRUE(device.frame.needs_clear);
  EXPECT_FALSE(device.frame.power_off) << "it is to slow down";
  EXPECT_FALSE(rig.completion());
  rig.clear();
  press(false);
  rig.step();
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "not while it slows down";
  until_rest();
  EXPECT_FALSE(is_slowing_down());
  EXPECT_TRUE(is_off());
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_TRUE(device.frame.needs_clear);
  for (const std::uint64_t id : {running, waiting}) {
    const auto verdict = rig.completion();
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->id, id);
    EXPECT_EQ(verdict->verdict, Verdict::kFault);
  }
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_FALSE(device.frame.needs_clear);
  EXPECT_FALSE(device.frame.power_off);
  EXPECT_FALSE(is_off());
}

TEST_F(FaultStops, ADeviceThatMissesFramesIsAwaitedSoThatNothingMovesAfterAClear) {
  go();
  rig.step(250);
  press(true);
  rig.step(20);
  device.takes = false;  // and is not lost yet
  until_set_points_rest();
  rig.step(100);
  EXPECT_TRUE(is_slowing_down());
  EXPECT_FALSE(device.frame.power_off);
  press(false);
  rig.step();
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "the device is not where the set-points are";
  device.takes = true;
  rig.step(2);
  EXPECT_FALSE(is_slowing_down());
  EXPECT_TRUE(device.frame.power_off);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(FaultStops, ADeviceThatMissesTheLastFramesOfAStopIsAwaitedByThePressAfterIt) {
  go();
  rig.step(250);
  rig.stop();
  rig.step(20);
  device.takes = false;
  until_set_points_rest();
  press(true);
  rig.step();
  EXPECT_TRUE(is_slowing_down());
  EXPECT_FALSE(device.frame.power_off);
  device.takes = true;
  rig.step(2);
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(FaultStops, ADeviceThatTakesNoFrameIsAwaitedForTheTimeOfARamp) {
  go();
  rig.step(250);
  press(true);
  rig.step(20);
  device.takes = false;
  int cycles = 20;
  for (; !device.frame.power_off && cycles < 2000; ++cycles) rig.step();
  EXPECT_NEAR(cycles, 1000, 5);
}

TEST_F(FaultStops, OfCategory0TakesTheEnergyOffAtOnce) {
  rig.settings.stop_category = 0;
  rig.restart();
  rig.step();
  go();
  rig.step(250);
  const Joints before = rig.snapshot.position_q;
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_FALSE(is_slowing_down());
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_EQ(rig.snapshot.position_q, before);
}

TEST_F(FaultStops, AMotionThatIsPressedInItsLastCyclesIsAFault) {
  const std::uint64_t id = go();
  const double duration_s =
      std::get<std::vector<Command>>(rig.planner.move_joints(rig.start(), {}, kThere, 0.0))
          .front()
          .duration_s;
  while (rig.snapshot.virtual_time_s < duration_s - 0.0015) rig.step();
  ASSERT_EQ(rig.snapshot.command_id, id);
  press(true);
  until_rest();
  rig.step();
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_TRUE(is_off());
}

TEST_F(FaultStops, ADwellAndAGripperEndToo) {
  for (const PlanResult& plan :
       {rig.planner.dwell(rig.start(), 5.0), rig.planner.gripper(rig.start(), 1.0)}) {
    rig.submit(plan);
    rig.step(100);
    press(true);
    until_rest();
    EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
    EXPECT_TRUE(is_off());
    press(false);
    rig.step();
    clear();
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
  }
  EXPECT_GT(rig.snapshot.gripper, 0.0);
  EXPECT_LT(rig.snapshot.gripper, 1.0);
}

TEST_F(FaultStops, AStopAndHoldKeepsTheEnergyUntilAFaultComes) {
  rig.servant->control.hold_count.fetch_add(1);
  rig.stop();
  rig.step();
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.needs_clear);
  EXPECT_FALSE(device.frame.power_off) << "category 2";
  press(true);
  rig.step();
  EXPECT_TRUE(device.frame.power_off);
}

TEST_F(FaultStops, ADeviceThatIsLostOnTheRampEndsIt) {
  go();
  rig.step(250);
  press(true);
  rig.step(3);
  ASSERT_TRUE(is_slowing_down());
  device.now = BackendHealth::kLost;
  rig.step();
  const Joints there = rig.snapshot.position_q;
  EXPECT_FALSE(is_slowing_down());
  rig.step();
  EXPECT_TRUE(is_off());
  EXPECT_EQ(rig.snapshot.position_q, there);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
}

TEST_F(FaultStops, AnInheritedErrorBeginsWithoutEnergy) {
  press(true);
  rig.step();
  press(false);
  rig.step();
  rig.restart({});
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(device.frame.power_off);
  clear();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_TRUE(is_unverified());
}

TEST_F(FaultStops, EncodersKnowWhereTheServosAreAfterwards) {
  for (const bool measures : {true, false}) {
    device.measures = measures;
    if (!measures) device.feedback = {};
    begin_anew({});
    press(true);
    rig.step();
    press(false);
    rig.step();
    clear();
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
    EXPECT_EQ(is_unverified(), !measures);
  }
}

}  // namespace
}  // namespace corbot::test::fault_stop_test
