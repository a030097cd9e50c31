// SPDX-License-Identifier: Apache-2.0
// StopAndHold in the cycle: a stop on the path, then no motion until a Clear, whichever process requests it
// or dies.
#include "rt/cycle/hold_latch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "corbot/motion/law_evaluation.h"
#include "rt/rig.h"

namespace corbot::test::hold_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};
constexpr int kLongestStop = 5000;  // cycles

class Hold : public ::testing::Test {
 protected:
  Hold() { rig.step(); }

  std::uint64_t go(const Joints& there = kThere) {
    return rig.submit(rig.planner.move_joints(rig.start(), {}, there, 0.0));
  }
  /// As the servant does: the request, then the stop.
  void hold() {
    rig.servant->control.hold_count.fetch_add(1);
    rig.stop();
  }
  [[nodiscard]] bool is_held() const { return (rig.snapshot.flags & kSnapshotHeld) != 0; }
  void until_error() {
    for (int i = 0; i < kLongestStop && rig.snapshot.state != RtState::kError; ++i) rig.step();
    ASSERT_EQ(rig.snapshot.state, RtState::kError);
    ASSERT_TRUE(is_held());
  }
  std::vector<AlarmCode> alarms() {
    std::vector<AlarmCode> codes;
    while (const auto alarm = rig.alarm()) codes.push_back(alarm->code);
    return codes;
  }

  /// Does one of many things, or nothing.
  void disturb(std::mt19937_64& random) {
    const auto one_of = [&](std::uint64_t count) { return random() % count; };
    switch (one_of(40)) {
      case 0:
        go({0.1 * static_cast<double>(one_of(8)), 1.2, 1.5, 0.5});
        break;
      case 1: {  // of any epoch and any task
        Command command =
            rig.stamp(std::get<std::vector<Command>>(rig.planner.dwell(rig.start(), 0.1)).front());
        command.epoch = random();
        command.incarnation = static_cast<std::uint32_t>(random());
        rig.push(command);
        break;
      }
      case 2:
        rig.stop();
        break;
      case 3:
        rig.pause(one_of(2) == 0);
        break;
      case 4:
        rig.override_to(one_of(2) == 0 ? 1.0 : 0.01);
        break;
      case 5:
        rig.cancel(1, random());
        break;
      case 6:
        if (one_of(20) == 0) rig.restart();
        break;
      case 7:
        rig.servant_responds = one_of(2) == 0;
        break;
      case 8:
        rig.servant->control.hold_count.fetch_add(1);
        break;
      default:
        break;
    }
  }

  Rig rig;
};

TEST_F(Hold, StopsOnThePathThenIsAnError) {
  const PlanResult plan = rig.planner.move_joints(rig.start(), {}, kThere, 0.0);
  const JointMotion motion = std::get<std::vector<Command>>(plan).front().joint;
  const std::uint64_t running = rig.submit(plan);
  const std::uint64_t waiting = rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  hold();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStopping);
  EXPECT_TRUE(is_held());
  EXPECT_TRUE(alarms().empty()) << "at rest only";
  double stopped_at_s = 0.0;
  for (int i = 0; i < kLongestStop && rig.snapshot.state != RtState::kError; ++i) {
    stopped_at_s = rig.snapshot.virtual_time_s;
    rig.step();
    EXPECT_EQ(rig.snapshot.holds_done, rig.snapshot.state == RtState::kError ? 1u : 0u);
  }
  for (std::size_t k = 0; k < rig.arm.dof; ++k)
    EXPECT_EQ(rig.snapshot.position_q[k], evaluate(motion.law[k], stopped_at_s).position);
  EXPECT_LT(stopped_at_s, motion.law[0].duration_s()) << "not at its end";
  EXPECT_EQ(rig.snapshot.stops_done, rig.servant->control.stop_count);
  EXPECT_EQ(alarms(), std::vector{AlarmCode::kHeld});
  for (const std::uint64_t id : {running, waiting}) {
    const auto verdict = rig.completion();
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->id, id);
    EXPECT_EQ(verdict->verdict, Verdict::kStopped);
  }
}

TEST_F(Hold, WithoutACountedStopTheMotionEndsAsStoppedToo) {
  go();
  rig.step(250);
  rig.servant->control.hold_count.fetch_add(1);
  until_error();
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
}

TEST_F(Hold, AtRestItIsAnErrorAtOnce) {
  hold();
  EXPECT_TRUE(rig.step().published);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.holds_done, 1u);
}

TEST_F(Hold, InAPauseToo) {
  go();
  rig.step(250);
  rig.pause(true);
  rig.step(2000);
  ASSERT_EQ(rig.snapshot.state, RtState::kPaused);
  hold();
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kStopped);
}

TEST_F(Hold, OnlyAClearEndsIt) {
  hold();
  until_error();
  (void)alarms();
  const Joints before = rig.snapshot.position_q;
  for (int i = 0; i < 10; ++i) {
    rig.stop();  // and motions of a newer number of stops
    go();
    rig.step(20);
    EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  }
  EXPECT_EQ(rig.snapshot.position_q, before);
  hold();
  rig.step();
  EXPECT_EQ(rig.snapshot.holds_done, 2u) << "who asks again is answered";
  EXPECT_TRUE(alarms().empty()) << "once";
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_FALSE(is_held());
  go();
  rig.step(50);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
  EXPECT_NE(rig.snapshot.position_q, before);
}

TEST_F(Hold, BeatsAClearInTheSameCycle) {
  hold();
  until_error();
  hold();
  rig.clear();
  rig.step();
  EXPECT_TRUE(is_held());
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.holds_done, 2u);
}

TEST_F(Hold, AClearBeforeTheArmIsAtRestDoesNotEndIt) {
  go();
  rig.step(250);
  hold();
  rig.step();
  rig.clear();
  until_error();
}

TEST_F(Hold, OutlivesAFaultThatComesMeanwhile) {
  go();
  rig.step(250);
  hold();
  rig.step();
  rig.backend.set_plugged(false);
  rig.step(2);
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.holds_done, 1u);
  EXPECT_EQ(alarms(), (std::vector{AlarmCode::kBackendLost, AlarmCode::kHeld}));
  rig.clear();
  rig.step();
  EXPECT_TRUE(is_held()) << "a Clear that leaves the robot in Error clears nothing";
  rig.backend.set_plugged(true);
  rig.step(20000);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  rig.clear();
  rig.step(250);  // the device comes slowly to where the arm is held
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_FALSE(is_held());
}

TEST_F(Hold, OutlivesItsTask) {
  hold();
  until_error();
  (void)alarms();
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(is_held());
  EXPECT_EQ(alarms(), (std::vector{AlarmCode::kErrorInherited, AlarmCode::kHeld}));
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.servant->control.holds_cleared = 1;
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Hold, OutlivesATaskThatWasKilledWhileItSlowedDown) {
  go();
  rig.step(250);
  hold();
  rig.step();
  ASSERT_EQ(rig.snapshot.state, RtState::kStopping);
  rig.servant->control.holds_cleared = 1;  // only the task knows
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(alarms(), std::vector{AlarmCode::kHeld});
}

TEST_F(Hold, ATaskThatHasLostItFindsItInTheServantsCounts) {
  hold();
  until_error();
  for (const bool is_cleared : {false, true}) {
    rig.task = std::make_unique<TaskSegment>();
    if (is_cleared) rig.servant->control.holds_cleared = 1;
    rig.restart();
    rig.step();
    EXPECT_EQ(is_held(), !is_cleared);
    EXPECT_EQ(rig.snapshot.state, is_cleared ? RtState::kStandby : RtState::kError);
  }
}

TEST_F(Hold, OutlivesEveryProcessByTheFileOnDisk) {
  rig.task = std::make_unique<TaskSegment>();
  rig.servant = std::make_unique<ServantSegment>();
  rig.restart({.held = true});
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_TRUE(is_held());
  EXPECT_EQ(alarms(), std::vector{AlarmCode::kHeld});
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.restart({.held = true});
  rig.step();
  EXPECT_FALSE(is_held()) << "the segment is newer";
}

TEST_F(Hold, OutlivesItsServant) {
  hold();
  until_error();
  auto next = std::make_unique<ServantSegment>();  // of one that has inherited nothing
  rig.cycle->connect({next.get(), ++rig.session});
  rig.servant = std::move(next);
  rig.step();
  EXPECT_TRUE(is_held());
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Hold, ARequestThatItsServantDidNotLiveToSeeAnsweredCounts) {
  auto next = std::make_unique<ServantSegment>();
  next->control.hold_count = 1;  // taken over
  rig.cycle->connect({next.get(), ++rig.session});
  rig.servant = std::move(next);
  rig.step();
  EXPECT_TRUE(is_held());
  EXPECT_EQ(rig.snapshot.holds_done, 1u);
}

/// Whatever is pushed, by whomever, in whatever order: from the request on no command begins, and from its
/// rest on the arm stands still, until a Clear.
TEST_F(Hold, NothingBeginsWhileHeld) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const auto one_of = [&](std::uint64_t count) { return random() % count; };
    for (std::uint64_t i = 0, motions = one_of(4); i < motions; ++i)
      go({0.1 * static_cast<double>(one_of(8)), 1.2, 1.5, 0.5});
    rig.step(static_cast<int>(one_of(600)));
    const std::uint64_t last_begun = std::max(rig.snapshot.command_id, rig.snapshot.last_done_id);
    hold();
    rig.step();
    bool at_rest = false;
    Joints rest{};
    for (int i = 0; i < 3000; ++i) {
      disturb(random);
      rig.step();
      ASSERT_TRUE(is_held());
      ASSERT_LE(rig.snapshot.command_id, last_begun) << "cycle " << i;
      if (at_rest) {
        // The cycle follows the position that a device reports in standby, rounded as pulses are.
        for (std::size_t joint = 0; joint < rest.size(); ++joint)
          ASSERT_NEAR(rig.snapshot.position_q[joint], rest[joint], 1e-9) << "cycle " << i;
      }
      at_rest = rig.snapshot.command_id == 0;
      rest = rig.snapshot.position_q;
      while (const auto verdict = rig.completion()) {
        if (verdict->id > last_begun) {
          ASSERT_NE(verdict->verdict, Verdict::kDone);
        }
      }
      (void)alarms();
    }
    ASSERT_TRUE(at_rest);
    ASSERT_EQ(rig.snapshot.state, RtState::kError);
    rig.pause(false);
    rig.override_to(1.0);
    rig.servant_responds = true;
    rig.servant->control.holds_cleared = rig.servant->control.hold_count.load();
    rig.clear();
    rig.step(2);
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
  }
}

}  // namespace
}  // namespace corbot::test::hold_test
