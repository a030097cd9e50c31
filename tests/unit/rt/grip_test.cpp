// SPDX-License-Identifier: Apache-2.0
// A gripper whose opening is measured: what it closes on, when its motion ends, and what is said of it.
#include <algorithm>

#include "rt/cycle/grip_watch.h"
#include "rt/fault_fixture.h"

namespace corbot::test::grip_test {
namespace {

using rt::GripWatch;

constexpr std::int64_t kCycle_ns = 1'000'000;

class Watch : public ::testing::Test {
 protected:
  void see(double commanded, double opening, int cycles = 1) {
    for (int i = 0; i < cycles; ++i) {
      now_ns += kCycle_ns;
      watch.see(commanded, {.measured = true, .time_ns = now_ns, .opening = opening}, true, kCycle_ns);
    }
  }
  GripWatch watch;
  std::int64_t now_ns{0};
};

TEST_F(Watch, WhatIsNotMeasuredIsNotKnown) {
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
  for (int i = 0; i < 500; ++i)
    watch.see(0.0, {.commanded = true, .time_ns = ++now_ns, .opening = 0.4}, true, kCycle_ns);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "a controller says what it sends";
  see(0.0, 0.4, 500);
  ASSERT_EQ(watch.grip(), GripWatch::Grip::kSomething);
  watch.see(0.0, {.measured = true, .time_ns = ++now_ns, .opening = 0.4}, false, kCycle_ns);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "without energy it holds nothing";
  for (int i = 0; i < 500; ++i)
    watch.see(0.0, {.measured = true, .time_ns = ++now_ns, .opening = -1.0}, true, kCycle_ns);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "joints only";
}

TEST_F(Watch, AReadingThatIsMissedNowAndThenChangesNothing) {
  see(0.0, 0.4, 200);
  ASSERT_EQ(watch.grip(), GripWatch::Grip::kSomething);
  for (int i = 0; i < 490; ++i) watch.see(0.0, {}, true, kCycle_ns);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kSomething);
  see(0.0, 0.4);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kSomething);
  for (int i = 0; i < 510; ++i) watch.see(0.0, {}, true, kCycle_ns);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "for too long";
  see(0.0, 0.4, 50);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "and begins anew";
}

TEST_F(Watch, ItHoldsOnceTheFingersHaveStoodStillShortOfTheirTarget) {
  for (double opening = 1.0; opening > 0.4; opening -= 0.01) see(0.0, opening);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "on the way";
  see(0.0, 0.4, 99);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
  see(0.0, 0.4, 3);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kSomething);
  EXPECT_TRUE(watch.is_at_rest());
  see(0.0, 0.3);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown) << "it slips";
  for (double opening = 0.3; opening > 0.0; opening -= 0.01) see(0.0, opening);
  see(0.0, 0.0);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kNothing);
}

TEST_F(Watch, OneThatIsKeptFromOpeningHoldsNothingThatItKnows) {
  see(1.0, 0.4, 500);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
  EXPECT_TRUE(watch.is_at_rest());
}

TEST_F(Watch, ARecordThatIsNotRenewedSaysNothing) {
  see(0.0, 0.4);
  for (int i = 0; i < 400; ++i) {
    watch.see(0.0, {.measured = true, .time_ns = now_ns, .opening = 0.4}, true, kCycle_ns);
    ASSERT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
  }
  EXPECT_FALSE(watch.is_at_rest());
  for (int i = 0; i < 600; ++i)
    watch.see(0.0, {.measured = true, .time_ns = now_ns, .opening = 0.4}, true, kCycle_ns);
  EXPECT_FALSE(watch.is_measured()) << "it is old";
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
}

TEST_F(Watch, ATargetThatStillMovesIsNotReached) {
  for (double commanded = 0.3; commanded > 0.0; commanded -= 0.001) see(commanded, 0.4);
  EXPECT_EQ(watch.grip(), GripWatch::Grip::kUnknown);
}

/// Fingers that follow their set-points at once, as far as nothing is in their way.
class Gripping : public FaultStops {
 protected:
  Gripping() {
    rig.settings.settle_ns = 1'000'000'000;
    device.encoders = device.measures = true;
    device.opening = 0.0;
    begin_anew({.position_known = true});
  }
  void step_fingers() {
    device.opening = std::clamp(rig.snapshot.gripper, narrowest, widest);
    rig.step();
  }
  /// Cycles until the verdict.
  int until_verdict(int most) {
    for (int i = 1; i <= most; ++i) {
      step_fingers();
      if (const auto taken = rig.completion()) {
        verdict = taken->verdict;
        return i;
      }
    }
    return most + 1;
  }
  int move_fingers(double opening) {
    rig.submit(rig.planner.gripper(rig.start(), opening));
    return until_verdict(5000);
  }
  double narrowest{0.0};
  double widest{1.0};
  Verdict verdict{};
};

TEST_F(Gripping, AFreeGripperArrivesAndHoldsNothing) {
  const int opened = move_fingers(1.0);
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_LT(opened, 700) << "its travel of half a second, and not the time for settling";
  EXPECT_NEAR(rig.snapshot.measured_opening, 1.0, 0.02);
  EXPECT_NE(rig.snapshot.flags & kSnapshotHoldsNothing, 0u);
  EXPECT_EQ(rig.snapshot.flags & kSnapshotHolding, 0u);
}

TEST_F(Gripping, ClosingOnAPieceEndsTheMotionAndIsNoFault) {
  (void)move_fingers(1.0);
  narrowest = 0.4;
  const int closed = move_fingers(0.0);
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_LT(closed, 800) << "travel, and a tenth of a second of standing still";
  EXPECT_NE(rig.snapshot.flags & kSnapshotHolding, 0u) << "known when the motion ends";
  EXPECT_EQ(rig.snapshot.flags & kSnapshotHoldsNothing, 0u);
  EXPECT_NEAR(rig.snapshot.gripper, 0.0, 1e-9) << "as it was told";
  EXPECT_NEAR(rig.snapshot.measured_opening, 0.4, 1e-9);
  for (int i = 0; i < 5000; ++i) step_fingers();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_FALSE(rig.alarm()) << "neither a following error nor a goal that is not reached";
  EXPECT_NE(rig.snapshot.flags & kSnapshotHolding, 0u);
  narrowest = 0.0;
  for (int i = 0; i < 200; ++i) step_fingers();
  EXPECT_NE(rig.snapshot.flags & kSnapshotHoldsNothing, 0u) << "it was taken away";
}

TEST_F(Gripping, ItMovesOnWithWhatItHolds) {
  (void)move_fingers(1.0);
  narrowest = 0.4;
  (void)move_fingers(0.0);
  go();
  for (int i = 0; i < 100; ++i) step_fingers();
  ASSERT_NE(rig.snapshot.command_id, 0u);
  EXPECT_NE(rig.snapshot.flags & kSnapshotHolding, 0u);
  (void)until_verdict(5000);
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_NE(rig.snapshot.flags & kSnapshotHolding, 0u);
}

TEST_F(Gripping, FingersThatAreSlowerThanTheirSetPointsAreAwaitedAndNoLonger) {
  widest = 0.3;  // jammed on the way to open
  const int opened = move_fingers(1.0);
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_LT(opened, 800);
  EXPECT_EQ(rig.snapshot.flags & (kSnapshotHolding | kSnapshotHoldsNothing), 0u);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);

  // Fingers that tremble never stand still: the motion ends all the same.
  rig.submit(rig.planner.gripper(rig.start(), 0.0));
  int cycles = 0;
  for (std::optional<Completion> ended; !ended && cycles < 5000; ++cycles) {
    device.opening = cycles % 2 == 0 ? 0.5 : 0.6;
    rig.step();
    ended = rig.completion();
    if (ended) {
      EXPECT_EQ(ended->verdict, Verdict::kDone);
    }
  }
  EXPECT_GT(cycles, 1000);
  EXPECT_LT(cycles, 2000) << "settle_s after its set-points";
  EXPECT_FALSE(rig.alarm());
}

TEST_F(Gripping, AStopEndsItAtOnce) {
  (void)move_fingers(1.0);
  narrowest = 0.9;
  rig.submit(rig.planner.gripper(rig.start(), 0.0));
  for (int i = 0; i < 300; ++i) step_fingers();
  rig.stop();
  EXPECT_LT(until_verdict(1000), 300);
  EXPECT_EQ(verdict, Verdict::kStopped);
}

}  // namespace
}  // namespace corbot::test::grip_test
