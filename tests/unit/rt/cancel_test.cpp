// SPDX-License-Identifier: Apache-2.0
// Commands that are taken back, and commands that were handed to an earlier task.
#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "corbot/channel/alarms.h"
#include "rt/rig.h"

namespace corbot::test::cancel_test {
namespace {

class CancelInCycle : public ::testing::Test {
 protected:
  CancelInCycle() { rig.step(); }

  /// Plans one behind the other, as the servant does.
  std::uint64_t go(double base_q) {
    Joints target = end_.position_q;
    target[0] = base_q;
    const auto plan = rig.planner.move_joints(end_, {}, target, 0.0);
    end_.position_q = target;
    return rig.submit(plan);
  }
  /// Steps until all of these have their verdicts.
  void until_verdicts(std::size_t count, int patience = 20000) {
    for (int i = 0; i < patience && verdicts.size() < count; ++i) step();
    ASSERT_EQ(verdicts.size(), count);
  }
  void step() {
    rig.step();
    while (const auto taken = rig.completion()) verdicts[taken->id] = taken->verdict;
  }

  Rig rig;
  PlanStart end_{};
  std::map<std::uint64_t, Verdict> verdicts;
};

TEST_F(CancelInCycle, WhatRunsBeforeItGoesOn) {
  const std::uint64_t first = go(0.5);
  const std::uint64_t second = go(0.9);
  const std::uint64_t third = go(0.2);
  rig.step(20);
  rig.cancel(second, third);
  rig.step();
  EXPECT_EQ(rig.snapshot.cancels_done, 1u) << "in force at once";
  EXPECT_EQ(rig.snapshot.command_id, first);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  end_.position_q[0] = 0.5;
  const std::uint64_t next = go(0.1);
  until_verdicts(4);
  EXPECT_EQ(verdicts[first], Verdict::kDone);
  EXPECT_EQ(verdicts[second], Verdict::kStopped);
  EXPECT_EQ(verdicts[third], Verdict::kStopped);
  EXPECT_EQ(verdicts[next], Verdict::kDone);
  EXPECT_NEAR(rig.snapshot.position_q[0], 0.1, 1e-12);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(CancelInCycle, WhatRunsSlowsDownOnItsPath) {
  const std::uint64_t first = rig.submit(rig.planner.drive(rig.start(), {}, 0, 1.0, 0.4));
  rig.step(500);
  ASSERT_GT(rig.snapshot.velocity_q_s[0], 0.0);
  rig.cancel(first, first);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStopping);
  until_verdicts(1);
  EXPECT_EQ(verdicts[first], Verdict::kStopped);
  EXPECT_LT(rig.snapshot.position_q[0], 0.9);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

/// A motion is stopped even if no ramp can end sooner than the motion itself: nothing must follow it.
TEST_F(CancelInCycle, AtTheVeryEndItIsStoppedAndNotDone) {
  for (const bool by_stop : {false, true}) {
    verdicts.clear();
    const std::uint64_t id = go(by_stop ? 0.0 : 0.4);
    for (;;) {
      step();
      ASSERT_TRUE(verdicts.empty());
      if (rig.snapshot.command_id == id &&
          rig.snapshot.command_duration_s - rig.snapshot.virtual_time_s < 0.0035)
        break;
    }
    by_stop ? rig.stop() : rig.cancel(id, id);
    until_verdicts(1);
    EXPECT_EQ(verdicts[id], Verdict::kStopped) << (by_stop ? "Stop" : "Cancel");
    end_.position_q = rig.snapshot.position_q;
  }
}

TEST_F(CancelInCycle, WhilePausedWithACommandTakenFromTheRing) {
  rig.pause(true);
  const std::uint64_t first = go(0.3);
  rig.step(2);
  EXPECT_EQ(rig.snapshot.waiting_id, first);
  rig.cancel(first, first);
  until_verdicts(1);
  EXPECT_EQ(verdicts[first], Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.waiting_id, 0u);
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
}

/// The task trusts no number in a request.
TEST_F(CancelInCycle, NumbersThatMeanNothingTakeNothingBack) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t done = go(0.1);
  until_verdicts(1);
  rig.cancel(0, done);
  const std::uint64_t first = go(0.3);
  rig.step();
  rig.cancel(first + 1, 0);
  rig.step();
  rig.cancel(kMost, kMost);
  rig.step();
  rig.cancel(first + 129, kMost);
  until_verdicts(2);
  EXPECT_EQ(verdicts[first], Verdict::kDone);
  EXPECT_EQ(rig.snapshot.cancels_done, 4u);
  const std::uint64_t last = go(0.5);
  rig.cancel(0, kMost);  // everything that is outstanding, and what comes before the task has seen it
  until_verdicts(3);
  EXPECT_EQ(verdicts[last], Verdict::kStopped);
}

TEST_F(CancelInCycle, ACommandForAnEarlierTaskIsNotCarriedOut) {
  auto plan = std::get<std::vector<Command>>(rig.planner.move_joints(rig.start(), {}, {0.5}, 0.0));
  const Command stale = rig.stamp(plan.front());
  ++rig.task->incarnation;
  rig.restart();
  ASSERT_TRUE(rig.push(stale));
  until_verdicts(1);
  EXPECT_EQ(verdicts[stale.id], Verdict::kLost);
  EXPECT_EQ(rig.snapshot.position_q[0], 0.0);
  EXPECT_FALSE(rig.alarm());
}

/// Dropped at the adoption: what the task before had taken from the ring and not begun, what the ring held,
/// and a number that was given away and not pushed.
TEST_F(CancelInCycle, ATaskThatAdoptsSaysWhatItDropped) {
  rig.pause(true);
  go(0.3);
  rig.step(2);
  go(0.5);
  const std::uint64_t last = rig.servant->next_command_id.fetch_add(1);
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.last_done_id, last);
  EXPECT_EQ(rig.snapshot.waiting_id, 0u);
  // A number that cannot be one is none.
  rig.servant->next_command_id.store(std::numeric_limits<std::uint64_t>::max());
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.last_done_id, last);
}

/// The place of the record in the ring says which alarms a Clear has taken back.
TEST_F(CancelInCycle, AClearIsReportedBetweenTheAlarmsBeforeAndAfterIt) {
  rig.emergency_stop->set(StopSource::kDevice, true);
  rig.step();
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kEmergencyStop);
  rig.clear();
  rig.step();
  EXPECT_FALSE(rig.alarm()) << "pressed still: nothing is cleared";
  rig.emergency_stop->set(StopSource::kDevice, false);
  rig.step();
  rig.clear();
  rig.emergency_stop->set(StopSource::kDevice, true);  // before the cycle that carries out the Clear
  rig.step();
  const auto cleared = rig.alarm();
  ASSERT_TRUE(cleared);
  EXPECT_EQ(cleared->code, AlarmCode::kCleared);
  EXPECT_EQ(corbot::alarm::cleared_count(*cleared), 2u);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kEmergencyStop) << "it came after";
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
}

}  // namespace
}  // namespace corbot::test::cancel_test
