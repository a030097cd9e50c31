// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/cycle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "channel/ring_access.h"
#include "corbot/motion/law_evaluation.h"
#include "rt/rig.h"

namespace corbot::test::cycle_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};

class CycleTest : public ::testing::Test {
 protected:
  CycleTest() { rig.step(); }

  std::uint64_t go(const Joints& target) {
    return rig.submit(rig.planner.move_joints(rig.start(), {}, target, 0.0));
  }
  /// Steps until the next verdict, and says how many it took.
  int until_verdict(int patience = 20000) {
    for (int i = 1; i <= patience; ++i) {
      rig.step();
      if (const auto taken = rig.completion()) {
        verdict = *taken;
        return i;
      }
    }
    ADD_FAILURE() << "no verdict";
    return patience;
  }
  void expect_holds(int cycles = 50) {
    const Joints here = rig.snapshot.position_q;
    for (int i = 0; i < cycles; ++i) {
      rig.step();
      ASSERT_EQ(rig.snapshot.position_q, here);
    }
  }

  Rig rig;
  Completion verdict{};
};

TEST_F(CycleTest, RunsACommandToItsEnd) {
  const std::uint64_t id = go(kThere);
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  EXPECT_EQ(rig.snapshot.command_id, id);
  until_verdict();
  EXPECT_EQ(verdict.id, id);
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(rig.snapshot.position_q[i], kThere[i], 1e-12);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_EQ(rig.snapshot.last_done_id, id);
  expect_holds();
}

TEST_F(CycleTest, SaysWhenTheServantMustBeWoken) {
  EXPECT_FALSE(rig.step().published);
  go(kThere);
  EXPECT_TRUE(rig.step().published);  // Standby → Moving
  EXPECT_FALSE(rig.step().published);
  rt::StepReport report{};
  for (int i = 0; i < 20000 && !report.published; ++i) report = rig.step();
  EXPECT_TRUE(report.at_rest);
  EXPECT_TRUE(rig.completion().has_value());
}

TEST_F(CycleTest, StopsOnThePathAndEmptiesTheQueue) {
  const auto plan = rig.planner.move_joints(rig.start(), {}, kThere, 0.0);
  const JointMotion motion = std::get<std::vector<Command>>(plan).front().joint;
  const std::uint64_t running = rig.submit(plan);
  rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  const std::uint64_t last = rig.submit(rig.planner.move_joints({kThere, 0.0}, {}, {}, 0.0));
  rig.step(250);
  rig.stop();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStopping);
  EXPECT_EQ(rig.stops_done(), 0u);
  double stopped_at_s = 0.0;
  for (int i = 0; i < 1000 && rig.snapshot.command_id == running; ++i) {
    stopped_at_s = rig.snapshot.virtual_time_s;
    rig.step();
  }
  verdict = rig.completion().value_or(Completion{});
  EXPECT_EQ(verdict.id, running);
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
  EXPECT_EQ(rig.completion()->id, last);
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(rig.snapshot.last_done_id, last);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  for (std::size_t i = 0; i < 4; ++i) {  // on the path, at rest
    EXPECT_EQ(rig.snapshot.position_q[i], evaluate(motion.law[i], stopped_at_s).position);
  }
  expect_holds();
  go({});
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
}

TEST_F(CycleTest, AStopAtRestIsDoneAtOnce) {
  rig.stop();
  EXPECT_TRUE(rig.step().published);
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(CycleTest, RefusesWhatWasPlannedBeforeAStop) {
  const PlanResult plan = rig.planner.move_joints(rig.start(), {}, kThere, 0.0);
  Command stale = rig.stamp(std::get<std::vector<Command>>(plan).front());
  rig.stop();
  rig.step();
  ASSERT_TRUE(rig.push(stale));
  until_verdict(3);
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  stale = rig.stamp(stale);
  stale.epoch = 1000;
  ASSERT_TRUE(rig.push(stale));
  until_verdict(3);
  EXPECT_EQ(verdict.verdict, Verdict::kMalformed);
  expect_holds();
}

TEST_F(CycleTest, KeepsWhatWasPlannedAfterAStop) {
  go(kThere);
  rig.step(200);
  rig.stop();  // and before it is carried out, a new call comes
  const std::uint64_t later = rig.submit(rig.planner.dwell({rig.snapshot.position_q, 0.0}, 0.01));
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  until_verdict();
  EXPECT_EQ(verdict.id, later);
  EXPECT_EQ(verdict.verdict,
            Verdict::kDiscontinuous);  // planned from where the arm was, not from where it stopped
}

TEST_F(CycleTest, PausesAndResumes) {
  go(kThere);
  rig.step(250);
  rig.pause(true);
  rig.step(1500);
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
  EXPECT_EQ(rig.snapshot.virtual_rate, 0.0);
  EXPECT_NE(rig.snapshot.command_id, 0u);
  expect_holds();
  rig.pause(false);
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
  EXPECT_NEAR(rig.snapshot.position_q[0], kThere[0], 1e-12);
}

TEST_F(CycleTest, PausedAtRestItBeginsNothing) {
  rig.pause(true);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
  go(kThere);
  expect_holds();
  EXPECT_FALSE(rig.completion().has_value());
  rig.pause(false);
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
}

TEST_F(CycleTest, StopsWhilePaused) {
  const std::uint64_t id = go(kThere);
  go(kThere);
  rig.step(250);
  rig.pause(true);
  rig.step(1500);
  rig.stop();
  EXPECT_LE(until_verdict(), 2);
  EXPECT_EQ(verdict.id, id);
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
}

TEST_F(CycleTest, StopsInTheMiddleOfAnyRamp) {
  for (int instant = 1; instant < 400; instant += 7) {
    go(instant % 2 == 0 ? kThere : Joints{});
    rig.step(200);
    rig.pause(true);
    rig.step(instant % 100);
    rig.pause(instant % 3 == 0);
    rig.step(instant);
    rig.stop();
    until_verdict(1500);
    rig.pause(false);
    rig.step(2);
    EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
    while (rig.completion()) {
    }
  }
}

/// At 40 degrees/s and 800 degrees/s² it is at rest 15 degrees later; at its full speed it would need more.
TEST_F(CycleTest, AStopWhileItAcceleratesSlowsDownAtOnce) {
  Joints there{};
  there[0] = 1.5;
  go(there);
  until_verdict();
  Joints back{};
  back[0] = -1.5;
  go(back);
  rig.step(100);
  const double begin_q = rig.snapshot.position_q[0];
  rig.stop();
  EXPECT_LE(until_verdict(1500), 310);
  EXPECT_LE(std::abs(rig.snapshot.position_q[0] - begin_q), 0.28);
}

TEST_F(CycleTest, OverrideStretchesTime) {
  go(kThere);
  const int full = until_verdict();
  rig.override_to(0.25);
  go({});
  const int quarter = until_verdict();
  EXPECT_NEAR(quarter, 4 * full, 10);
  // While moving, too.
  rig.override_to(1.0);
  go(kThere);
  rig.step(full / 4);  // not braking yet: a motion that is ending is not slowed further
  rig.override_to(0.1);
  EXPECT_GT(until_verdict(), full);
  EXPECT_NEAR(rig.snapshot.override_ratio, 0.1, 0);
}

TEST_F(CycleTest, TrustsNoOverride) {
  for (const double hostile :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    rig.override_to(hostile);
    rig.step();
    EXPECT_EQ(rig.snapshot.override_ratio, 1.0);
  }
  rig.override_to(1e9);
  rig.step();
  EXPECT_EQ(rig.snapshot.override_ratio, 1.0);
  rig.override_to(-5);
  rig.step();
  EXPECT_GT(rig.snapshot.override_ratio, 0.0);
  EXPECT_LE(rig.snapshot.override_ratio, 0.01);
}

TEST_F(CycleTest, DwellAndGripperFollowVirtualTime) {
  rig.submit(rig.planner.dwell(rig.start(), 0.5));
  rig.step(100);
  rig.pause(true);
  rig.step(1000);
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
  rig.pause(false);
  EXPECT_NEAR(until_verdict(), 400, 2);
  rig.submit(rig.planner.gripper(rig.start(), 1.0));
  rig.step(150);
  rig.stop();
  until_verdict(1000);
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  EXPECT_GT(rig.snapshot.gripper, 0.0);
  EXPECT_LT(rig.snapshot.gripper, 1.0);
  EXPECT_NEAR(rig.snapshot.pulse_us[4], 1900 - 800 * rig.snapshot.gripper, 1e-9);
}

TEST_F(CycleTest, ALostBackendIsAFaultUntilItIsBackAndCleared) {
  const std::uint64_t running = go(kThere);
  const std::uint64_t waiting = rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  rig.backend.set_plugged(false);
  until_verdict(1);
  EXPECT_EQ(verdict.id, running);
  EXPECT_EQ(verdict.verdict, Verdict::kFault);
  EXPECT_EQ(rig.completion()->id, waiting);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kBackendLost);
  expect_holds();

  go(kThere);
  until_verdict(2);
  EXPECT_EQ(verdict.verdict, Verdict::kFault);
  rig.stop();
  rig.step();
  EXPECT_EQ(rig.stops_done(), 1u);

  rig.clear();  // while the cause is still there
  rig.step();
  EXPECT_EQ(rig.snapshot.clears_done, 1u);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  rig.backend.set_plugged(true);
  rig.step(250);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.clears_done, 2u);
  rig.step(250);  // the device is brought to the set-point first
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  go({});
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
}

TEST_F(CycleTest, ARestartedTaskTakesUpThePositionAndDropsTheQueue) {
  go(kThere);
  rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  const Snapshot before = rig.snapshot;
  rig.stop();  // requested while no task ran
  rig.restart();
  EXPECT_EQ(rig.cycle->frame().cycle, before.cycle) << "else a device's thread counts all cycles before";
  rig.step();
  EXPECT_EQ(rig.snapshot.position_q, before.position_q);
  EXPECT_EQ(rig.snapshot.pulse_us, before.pulse_us);
  EXPECT_EQ(rig.snapshot.last_done_id, 2u);
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(rig.snapshot.cycle, before.cycle + 1);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  expect_holds();
  EXPECT_FALSE(rig.completion().has_value());
  go({});
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
}

TEST_F(CycleTest, ARestartedTaskDoesNotBelieveAnImpossiblePosition) {
  Snapshot hostile = rig.snapshot;
  hostile.position_q[2] = std::numeric_limits<double>::quiet_NaN();
  hostile.gripper = std::numeric_limits<double>::infinity();
  rig.task->snapshot.store(hostile);
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.position_q, Joints{});
  EXPECT_EQ(rig.snapshot.gripper, 0.0);
}

TEST_F(CycleTest, ACorruptRingIsEmptiedAndSaidSo) {
  const std::uint64_t lost = go(kThere);
  RingIndices::set_head(rig.servant->commands, 1'000'000);
  until_verdict(2);
  EXPECT_EQ(verdict.id, lost);
  EXPECT_EQ(verdict.verdict, Verdict::kDropped);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kRingCorrupt);
  expect_holds();
  go(kThere);
  until_verdict();
  EXPECT_EQ(verdict.verdict, Verdict::kDone);
}

TEST_F(CycleTest, AFullCompletionRingHoldsNothingUp) {
  for (int i = 0; i < 300; ++i) {
    ASSERT_NE(rig.submit(rig.planner.dwell(rig.start(), 0.0)), 0u);
    rig.step(3);
  }
  EXPECT_EQ(rig.snapshot.last_done_id, 300u);
  EXPECT_EQ(ring_size(rig.task->completions, rig.servant->completions_tail), 128u);
}

TEST_F(CycleTest, ShutdownBringsTheMotionToRest) {
  go(kThere);
  rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  rig.cycle->begin_shutdown();
  EXPECT_FALSE(rig.step().at_rest);
  until_verdict(1000);
  EXPECT_EQ(verdict.verdict, Verdict::kEnded);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kEnded);
  EXPECT_TRUE(rig.step().at_rest);
}

TEST_F(CycleTest, WhatAStopEndsIsStoppedInAShutdownToo) {
  go(kThere);
  rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  rig.stop();
  rig.cycle->begin_shutdown();
  until_verdict(1000);
  EXPECT_EQ(verdict.verdict, Verdict::kStopped);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
}

}  // namespace
}  // namespace corbot::test::cycle_test
