// SPDX-License-Identifier: Apache-2.0
// Tests the ramp of joints if there is no path to slow down on.
#include "rt/cycle/joint_ramp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <variant>
#include <vector>

#include "rt/bad_line.h"
#include "rt/cycle/path_evaluation.h"
#include "rt/fault_fixture.h"

namespace corbot::test::joint_ramp_test {
namespace {

class BadPath : public FaultStops {
 protected:
  BadPath() {
    line.begin(rig);
    id = rig.servant->next_command_id.load() - 1;
    differences = Differences(rig.arm, rig.snapshot.position_q);
  }
  /// Until the alarm of the bad path; the greatest share of a joint's limit before it.
  void until_alarm() {
    for (int i = 0; i < kLongestStop && !cause; ++i) {
      rig.step();
      const double share = differences.see(rig.snapshot.position_q);
      cause = rig.alarm();
      (cause ? at_fault : before) = share;
    }
    ASSERT_TRUE(cause);
    ASSERT_NE(cause->code, AlarmCode::kCommandRefused) << cause->value;
  }
  BadLine line;
  std::uint64_t id{};
  Differences differences{rig.arm, rig.snapshot.position_q};
  std::optional<AlarmEvent> cause;
  double before{};
  double at_fault{};
};

TEST_F(BadPath, IsLeftOnARampOfTheJoints) {
  until_alarm();
  EXPECT_GE(cause->code, AlarmCode::kSetPointNotFinite);
  EXPECT_LE(cause->code, AlarmCode::kKinematicsFailed);
  EXPECT_TRUE(is_slowing_down());
  EXPECT_FALSE(device.frame.power_off);
  const Joints at_fault_q = rig.snapshot.position_q;
  EXPECT_NE(rig.snapshot.velocity_q_s, Joints{}) << "a step to rest";
  std::vector<double> shares;
  for (int i = 0; i < kLongestStop && rig.snapshot.command_id != 0; ++i) {
    rig.step();
    shares.push_back(differences.see(rig.snapshot.position_q));
  }
  ASSERT_GT(shares.size(), 20u);
  EXPECT_NE(rig.snapshot.position_q, at_fault_q);
  // Near the base the line itself was beyond a joint's limits; what follows is not.
  for (std::size_t i = shares.size() / 2; i < shares.size(); ++i) EXPECT_LE(shares[i], 1.0 + 1e-4) << i;
  const auto verdict = rig.completion();
  ASSERT_TRUE(verdict);
  EXPECT_EQ(verdict->id, id);
  EXPECT_EQ(verdict->verdict, Verdict::kFault);
  EXPECT_TRUE(device.frame.power_off);
  EXPECT_TRUE(is_off());
}

TEST_F(BadPath, OnTheRampOfAStopInputGoesOverIntoTheJoints) {
  // Pressed so shortly before that the ramp on the path still reaches the bad place.
  Rig probe(device);
  line.begin(probe);
  int cycles = 0;
  while (!probe.alarm() && cycles < kLongestStop) {
    probe.step();
    ++cycles;
  }
  rig.step(cycles - 5);
  press(true);
  rig.step();
  ASSERT_EQ(rig.alarm()->code, AlarmCode::kEmergencyStop);
  until_alarm();
  EXPECT_GE(cause->code, AlarmCode::kSetPointOutOfRange);
  EXPECT_LE(cause->code, AlarmCode::kKinematicsFailed);
  EXPECT_TRUE(is_slowing_down());
  until_rest();
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_FALSE(rig.completion()) << "once";
  EXPECT_TRUE(is_off());
}

TEST_F(BadPath, AfterAGapOnTheRampTheArmIsAtRest) {
  until_alarm();
  rig.now_ns += 20'000'000;
  rig.step();
  EXPECT_FALSE(is_slowing_down());
  EXPECT_EQ(rig.snapshot.velocity_q_s, Joints{});
  EXPECT_TRUE(is_off());
}

TEST(JointRamp, KeepsEveryLimitFromWhereverAJointMotionIs) {
  std::mt19937_64 random(7);
  const auto uniform = [&random](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  const ArmModel arm = shipped_lynx5();
  Rig planning;
  planning.step();
  for (int round = 0; round < 400; ++round) {
    Joints from{};
    Joints to{};
    double tolerance = 1e-4;
    for (std::size_t i = 0; i < arm.dof; ++i) {
      from[i] = uniform(arm.joints[i].lower_q, arm.joints[i].upper_q);
      to[i] = uniform(arm.joints[i].lower_q, arm.joints[i].upper_q);
      if (uniform(0.0, 1.0) > 0.1) continue;
      to[i] = arm.joints[i].upper_q;
      tolerance = 0.02;  // what is cut off a set-point's way to the very end of the range is braked for
    }
    const PlanResult plan = planning.planner.move_joints({from, 0.0}, {}, to, 0.0);
    const auto* const commands = std::get_if<std::vector<Command>>(&plan);
    ASSERT_NE(commands, nullptr);
    const Command& command = commands->front();
    const rt::SetPoint base{from, 0.0};
    rt::JointRamp ramp(arm);
    ramp.rest_at(from);
    Differences differences(arm, from);
    const double until_s = uniform(0.0, command.duration_s);
    for (double t_s = 1e-3; t_s < until_s; t_s += 1e-3) {
      const Joints at = rt::evaluate_command(arm, command, base, t_s).position_q;
      ramp.see(at);
      ASSERT_LE(differences.see(at), 1.0 + 1e-4);
    }
    ramp.begin();
    int cycles = 0;
    Joints last{};
    do {
      last = ramp.next();
      ramp.see(last);
      ASSERT_LE(differences.see(last), 1.0 + tolerance) << "round " << round << ", cycle " << cycles;
      ASSERT_LT(++cycles, 1000);
    } while (!ramp.at_rest());
    // v/a + 2 a/j at the most, of the slowest joint.
    EXPECT_LE(cycles, 460);
    EXPECT_LE(differences.see(ramp.next()), 1.0 + 1e-4) << "nothing creeps on";
  }
}

TEST(JointRamp, BrakesHarderRatherThanLeaveTheRange) {
  const ArmModel arm = shipped_lynx5();
  rt::JointRamp ramp(arm);
  Joints at{};
  at[0] = arm.joints[0].upper_q - 0.05;
  ramp.rest_at(at);
  for (int i = 0; i < 10; ++i) {
    at[0] += 0.003;
    ramp.see(at);
  }
  ramp.begin();
  do {
    at = ramp.next();
    ramp.see(at);
    ASSERT_LE(at[0], arm.joints[0].upper_q);
  } while (!ramp.at_rest());
  EXPECT_GT(at[0], arm.joints[0].upper_q - 0.02);
}

}  // namespace
}  // namespace corbot::test::joint_ramp_test
