// SPDX-License-Identifier: Apache-2.0
// Gaps between steps, overruns, and a servant that does not respond.
#include "rt/cycle/liveness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "corbot/channel/alarms.h"
#include "corbot/motion/law_evaluation.h"
#include "rt/rig.h"

namespace corbot::test::liveness_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};

class Liveness : public ::testing::Test {
 protected:
  Liveness() {
    rig.step();
    plan = rig.planner.move_joints(rig.start(), {}, kThere, 0.0);
  }

  void begin_motion(int cycles = 250) {
    rig.submit(plan);
    rig.step(cycles);
    ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  }
  void skip_ms(std::int64_t milliseconds) { rig.now_ns += milliseconds * 1'000'000; }
  std::optional<Verdict> until_verdict(int patience = 20000) {
    for (int i = 0; i < patience; ++i) {
      if (const auto taken = rig.completion()) return taken->verdict;
      rig.step();
    }
    return std::nullopt;
  }
  int count_alarms(AlarmCode code) {
    int count = 0;
    while (const auto alarm = rig.alarm()) {
      count += alarm->code == code ? 1 : 0;
      if (alarm->code == code) last_alarm = *alarm;
    }
    return count;
  }

  Rig rig;
  PlanResult plan;
  AlarmEvent last_alarm{};
};

TEST_F(Liveness, AfterAFewPeriodsWithoutAStepTheMotionBeginsAgainFromRest) {
  // The servos have come to rest at the last set-point: no joint may be given more than its acceleration
  // from there.
  std::mt19937_64 random(7);
  for (int round = 0; round < 40; ++round) {
    begin_motion(50 + static_cast<int>(random() % 500));
    ASSERT_GT(rig.snapshot.virtual_rate, 0.99);
    Joints before = rig.snapshot.position_q;
    Joints velocity{};
    skip_ms(rt::GapWatch::kRestartPeriods + static_cast<std::int64_t>(random() % 90));
    const double period_s = static_cast<double>(rig.arm.period_ns) * 1e-9;
    std::optional<Completion> end;
    for (int i = 0; !end && i < 20000; ++i) {
      rig.step();
      for (std::size_t k = 0; k < rig.arm.dof; ++k) {
        const double now = (rig.snapshot.position_q[k] - before[k]) / period_s;
        const double allowed = rig.arm.joints[k].acceleration_q_s2 * period_s * 1.001 + 1e-6;
        ASSERT_LE(std::abs(now - velocity[k]), allowed)
            << "round " << round << " joint " << k << " step " << i;
        velocity[k] = now;
      }
      before = rig.snapshot.position_q;
      end = rig.completion();
    }
    ASSERT_TRUE(end.has_value());
    ASSERT_EQ(end->verdict, Verdict::kDone);
    for (std::size_t k = 0; k < rig.arm.dof; ++k) ASSERT_NEAR(rig.snapshot.position_q[k], kThere[k], 1e-9);
    ASSERT_NE(rig.submit(rig.planner.move_joints(rig.start(), {}, {}, 0.0)), 0u);
    ASSERT_EQ(until_verdict(), Verdict::kDone);
  }
}

TEST_F(Liveness, AFewMissedPeriodsOnlyDelay) {
  begin_motion();
  skip_ms(rt::GapWatch::kRestartPeriods - 1);
  rig.step();
  EXPECT_EQ(rig.snapshot.virtual_rate, 1.0);
  EXPECT_EQ(until_verdict(), Verdict::kDone);
  EXPECT_FALSE(rig.alarm().has_value());
}

TEST_F(Liveness, AStopDuringAGapIsDoneAtItsEnd) {
  begin_motion();
  const Joints here = rig.snapshot.position_q;
  skip_ms(50);
  rig.stop();
  rig.step(2);  // one to see it, one to report
  EXPECT_EQ(rig.stops_done(), 1u);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.position_q, here);
}

TEST_F(Liveness, AnOverrideStillHoldsAfterAGap) {
  rig.override_to(0.3);
  begin_motion();
  skip_ms(20);
  double highest = 0.0;
  for (int i = 0; i < 600; ++i) {
    rig.step();
    highest = std::max(highest, rig.snapshot.virtual_rate);
  }
  EXPECT_NEAR(highest, 0.3, 1e-12);
}

TEST_F(Liveness, ALongGapIsAFaultUntilItIsCleared) {
  begin_motion();
  ASSERT_NE(rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0)), 0u);
  const Joints here = rig.snapshot.position_q;
  skip_ms(100);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.position_q, here);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  ASSERT_EQ(count_alarms(AlarmCode::kLoopGap), 1);
  EXPECT_NEAR(alarm::gap_s(last_alarm), 0.101, 1e-9);
  rig.step(1000);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.position_q, here);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  ASSERT_NE(rig.submit(rig.planner.move_joints(rig.start(), {}, kThere, 0.0)), 0u);
  EXPECT_EQ(until_verdict(), Verdict::kDone);
}

TEST_F(Liveness, WhatTheMachineWasSuspendedIsAGap) {
  begin_motion();
  const Joints here = rig.snapshot.position_q;
  rig.cycle->count_suspension(3'600'000'000'000);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.position_q, here);
  ASSERT_EQ(count_alarms(AlarmCode::kLoopGap), 1);
  EXPECT_NEAR(alarm::gap_s(last_alarm), 3600.001, 1e-6);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby) << "counted once";
}

/// The loop's readings of the clocks; between any two of them it may be preempted.
class Suspensions {
 public:
  explicit Suspensions(bool preempted) : preempted_(preempted) {}
  struct Look {
    std::int64_t slept_ns;
    std::int64_t seen_ns;
  };
  Look next() {
    std::int64_t slept_ns = 0;
    if (random_() % 50 == 0) slept_ns = 1'000'000'000 + static_cast<std::int64_t>(random_() % 1'000'000'000);
    suspended_ns_ += slept_ns;
    now_ns_ += 1'000'000;
    const std::int64_t before_ns = read();
    const std::int64_t boot_ns = read() + suspended_ns_;
    return {slept_ns, watch_.see(before_ns, boot_ns, read())};
  }

 private:
  std::int64_t read() {
    now_ns_ += 20;
    if (preempted_ && random_() % 100 == 0) now_ns_ += static_cast<std::int64_t>(random_() % 3'000'000'000);
    return now_ns_;
  }
  bool preempted_;
  std::mt19937_64 random_{11};
  std::int64_t now_ns_{1'000'000'000};
  std::int64_t suspended_ns_{5'000'000'000};  // before this process
  rt::SuspensionWatch watch_;
};

TEST(SuspensionWatch, SeesHowLongTheMachineWasSuspended) {
  Suspensions machine(false);
  (void)machine.next();
  for (int i = 0; i < 20'000; ++i) {
    const auto [slept_ns, seen_ns] = machine.next();
    ASSERT_NEAR(static_cast<double>(seen_ns), static_cast<double>(slept_ns), 100.0) << i;
  }
}

TEST(SuspensionWatch, TakesNoPreemptionForOne) {
  Suspensions machine(true);
  (void)machine.next();
  std::int64_t slept_total_ns = 0;
  std::int64_t seen_total_ns = 0;
  for (int i = 0; i < 20'000; ++i) {
    const auto [slept_ns, seen_ns] = machine.next();
    slept_total_ns += slept_ns;
    seen_total_ns += seen_ns;
    ASSERT_LE(seen_total_ns, slept_total_ns) << i;
  }
  EXPECT_GT(seen_total_ns, slept_total_ns / 2);
}

TEST_F(Liveness, ALongGapAtRestIsAFaultToo) {
  skip_ms(100);
  rig.clear();  // asked for before anyone could know of the gap
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(count_alarms(AlarmCode::kLoopGap), 1);
}

TEST_F(Liveness, TheProfileDecidesHowLongAGapMayBe) {
  rig.settings.liveness.gap_fault_ns = 5'000'000'000;
  rig.restart();
  rig.step();
  skip_ms(4900);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  skip_ms(5000);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
}

TEST_F(Liveness, ATaskInPlaceOfAFrozenOneBeginsInError) {
  rig.restart({.after_gap = true});
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(count_alarms(AlarmCode::kTaskReplaced), 1);
  rig.step(10);
  EXPECT_EQ(count_alarms(AlarmCode::kTaskReplaced), 0);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.restart();  // in place of one that died
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Liveness, OverrunsAreReportedAtOnceAndThenOnceAMinute) {
  for (int i = 0; i < 10; ++i) rig.cycle->count_overrun();
  rig.step();
  ASSERT_EQ(count_alarms(AlarmCode::kOverrun), 1);
  EXPECT_EQ(alarm::overruns(last_alarm).count, 10u);
  EXPECT_EQ(rig.snapshot.overruns, 10u);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  for (int i = 0; i < 59'000; ++i) {
    if (i % 1000 == 0) rig.cycle->count_overrun();
    rig.step();
  }
  EXPECT_EQ(count_alarms(AlarmCode::kOverrun), 0);
  rig.step(1001);
  ASSERT_EQ(count_alarms(AlarmCode::kOverrun), 1);
  EXPECT_EQ(alarm::overruns(last_alarm).count, 59u);
  EXPECT_EQ(alarm::overruns(last_alarm).total, 69u);
  rig.step(200'000);
  EXPECT_EQ(count_alarms(AlarmCode::kOverrun), 0);
}

TEST_F(Liveness, AMotionWithoutAServantIsStoppedOnItsPath) {
  rig.settings.liveness.orphan_ns = 200'000'000;
  rig.restart();
  const JointMotion motion = std::get<std::vector<Command>>(plan).front().joint;
  begin_motion(100);
  ASSERT_NE(rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0)), 0u);
  rig.servant_responds = false;
  rig.step(200);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  EXPECT_FALSE(rig.alarm().has_value());
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kStopping);
  double stopped_at_s = 0.0;
  for (int i = 0; i < 1000 && rig.snapshot.command_id != 0; ++i) {
    stopped_at_s = rig.snapshot.virtual_time_s;
    rig.step();
  }
  EXPECT_EQ(rig.completion()->verdict, Verdict::kOrphaned);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kOrphaned);
  EXPECT_EQ(count_alarms(AlarmCode::kServantSilent), 1);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);  // a servant's death needs no Clear
  for (std::size_t k = 0; k < rig.arm.dof; ++k)
    EXPECT_EQ(rig.snapshot.position_q[k], evaluate(motion.law[k], stopped_at_s).position);
  rig.step(1000);
  EXPECT_EQ(count_alarms(AlarmCode::kServantSilent), 0) << "at rest nothing needs a servant";
  rig.servant_responds = true;
  ASSERT_NE(rig.submit(rig.planner.move_joints(rig.start(), {}, kThere, 0.0)), 0u);
  EXPECT_EQ(until_verdict(), Verdict::kDone);
}

TEST_F(Liveness, AServantThatIsBackInTimeLetsTheMotionRunOn) {
  rig.settings.liveness.orphan_ns = 200'000'000;
  rig.restart();
  begin_motion(100);
  for (int i = 0; i < 3; ++i) {
    rig.servant_responds = false;
    rig.step(150);
    rig.servant_responds = true;
    rig.step();
  }
  EXPECT_EQ(until_verdict(), Verdict::kDone);
  EXPECT_FALSE(rig.alarm().has_value());
}

TEST_F(Liveness, WhatWaitsInAPauseNeedsAServantToo) {
  rig.settings.liveness.orphan_ns = 200'000'000;
  rig.restart();
  rig.pause(true);
  rig.step();
  rig.submit(plan);
  rig.servant_responds = false;
  EXPECT_EQ(until_verdict(300), Verdict::kOrphaned);
}

TEST_F(Liveness, TheTasksOwnGapIsNotTheServantsSilence) {
  rig.settings.liveness.orphan_ns = 200'000'000;
  rig.settings.liveness.gap_fault_ns = 10'000'000'000;
  rig.restart();
  begin_motion(100);
  rig.servant_responds = false;
  skip_ms(5000);  // both were frozen, and the task is the first to run again
  rig.step(50);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  rig.servant_responds = true;
  EXPECT_EQ(until_verdict(), Verdict::kDone);
}

}  // namespace
}  // namespace corbot::test::liveness_test
