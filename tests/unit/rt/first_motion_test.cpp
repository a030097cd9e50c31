// SPDX-License-Identifier: Apache-2.0
// The cycle while the arm's position is unverified.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/rig.h"

namespace corbot::test::first_motion_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};
const Joints kSaved{0.1, 0.2, 0.3, 0.4};

class FirstMotion : public ::testing::Test {
 protected:
  void power_up(const rt::CycleStart& start) {
    rig.task = std::make_unique<TaskSegment>();
    rig.servant = std::make_unique<ServantSegment>();
    rig.restart(start);
    rig.step();
  }
  void go(const Joints& target) { rig.submit(rig.planner.move_joints(rig.start(), {}, target, 0.0)); }
  /// Cycles until the verdict; the highest rate on the way is in `rate`.
  int run() {
    rate = 0.0;
    for (int i = 1; i <= 100'000; ++i) {
      rig.step();
      rate = std::max(rate, rig.snapshot.virtual_rate);
      if (const auto taken = rig.completion()) {
        verdict = taken->verdict;
        return i;
      }
    }
    ADD_FAILURE() << "no verdict";
    return 0;
  }
  [[nodiscard]] bool unverified() const { return (rig.snapshot.flags & kSnapshotUnverified) != 0; }

  Rig rig;
  double rate{};
  Verdict verdict{};
};

TEST_F(FirstMotion, BeginsAtTheGivenPosition) {
  power_up({kSaved, 0.5, false});
  EXPECT_EQ(rig.snapshot.position_q, kSaved);
  EXPECT_EQ(rig.snapshot.gripper, 0.5);
  EXPECT_FALSE(unverified());
  go(kThere);
  run();
  EXPECT_EQ(rate, 1.0);
}

TEST_F(FirstMotion, IsSlowAndTheSecondIsNot) {
  power_up({kSaved, 0.0, true});
  EXPECT_TRUE(unverified());
  EXPECT_NEAR(rig.snapshot.override_ratio, 0.1, 0.0);
  go(kThere);
  const int slow = run();
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_NEAR(rate, 0.1, 1e-12);
  EXPECT_FALSE(unverified());
  EXPECT_EQ(rig.snapshot.override_ratio, 1.0) << "in the very cycle of the verdict";
  go(kSaved);
  const int fast = run();
  EXPECT_EQ(rate, 1.0);
  EXPECT_EQ(rig.snapshot.override_ratio, 1.0);
  EXPECT_NEAR(slow, 10 * fast, 20);
}

TEST_F(FirstMotion, KeepsAnOverrideThatIsLower) {
  rig.override_to(0.05);
  power_up({kSaved, 0.0, true});
  rig.override_to(0.05);
  go(kThere);
  run();
  EXPECT_NEAR(rate, 0.05, 1e-12);
}

TEST_F(FirstMotion, IsOneThatMovesTheArmToItsEnd) {
  power_up({kSaved, 0.0, true});
  rig.submit(rig.planner.dwell(rig.start(), 0.01));
  run();
  EXPECT_TRUE(unverified()) << "a pause is no motion";
  go(kSaved);
  run();
  EXPECT_TRUE(unverified()) << "nor is a motion to where it is";
  rig.submit(rig.planner.gripper(rig.start(), 1.0));
  run();
  EXPECT_TRUE(unverified()) << "nor is the gripper's";
  EXPECT_NEAR(rate, 0.1, 1e-12) << "but it is slow, too";
  go(kThere);
  rig.step(1000);
  rig.stop();
  run();
  EXPECT_EQ(verdict, Verdict::kStopped);
  EXPECT_TRUE(unverified()) << "a stop may have had a reason";
  go(kThere);
  run();
  EXPECT_FALSE(unverified());
}

TEST_F(FirstMotion, ARestartBeforeItForgetsNothing) {
  power_up({kSaved, 0.0, true});
  rig.restart({{}, 0.0, false});
  rig.step();
  EXPECT_TRUE(unverified());
  EXPECT_EQ(rig.snapshot.position_q, kSaved);
  go(kThere);
  run();
  rig.restart({{}, 0.0, true});
  rig.step();
  EXPECT_FALSE(unverified()) << "the segment ranks higher";
}

TEST_F(FirstMotion, AStartMayOutrankTheSegment) {
  power_up({kThere, 1.0, false});
  rig.restart({.position_q = kSaved, .opening = 0.5, .unverified = true, .outranks_segment = true});
  rig.step();
  EXPECT_TRUE(unverified());
  EXPECT_EQ(rig.snapshot.position_q, kSaved);
  EXPECT_EQ(rig.snapshot.gripper, 0.5);
}

TEST_F(FirstMotion, ComesAgainWhenTheEnergyWasOffAndNobodyKnowsWhereTheServosAre) {
  for (const bool is_known : {true, false}) {
    power_up({.position_q = kSaved, .position_known = is_known});
    rig.emergency_stop->set(StopSource::kGpio, true);
    rig.step();
    rig.clear();
    rig.step();
    EXPECT_FALSE(unverified()) << "still without power";
    rig.emergency_stop->set(StopSource::kGpio, false);
    rig.step();
    rig.clear();
    rig.step();
    ASSERT_EQ(rig.snapshot.state, RtState::kStandby);
    EXPECT_EQ(unverified(), !is_known);
    go(kThere);
    run();
    EXPECT_NEAR(rate, is_known ? 1.0 : 0.1, 1e-12);
    EXPECT_FALSE(unverified());
  }
}

TEST_F(FirstMotion, TrustsNoStart) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  power_up({{100.0, nan, -100.0, 0.0}, nan, true});
  EXPECT_EQ(rig.snapshot.position_q[0], rig.arm.joints[0].upper_q);
  EXPECT_EQ(rig.snapshot.position_q[1], 0.0);
  EXPECT_EQ(rig.snapshot.position_q[2], rig.arm.joints[2].lower_q);
  EXPECT_EQ(rig.snapshot.gripper, 0.0);
}

}  // namespace
}  // namespace corbot::test::first_motion_test
