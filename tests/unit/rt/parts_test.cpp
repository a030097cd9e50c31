// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/cycle/servo_map.h"
#include "rt/cycle/set_point_check.h"
#include "rt/rig.h"
#include "sim/servo_model.h"

namespace corbot::test::parts_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ServoMap, MapsBoundsAndNeverSaysNan) {
  const ServoMap servo{0, 1500.0, 600.0, -1.0, 500.0, 2500.0};
  EXPECT_DOUBLE_EQ(rt::joint_pulse_us(servo, 0.5, 1500), 1200.0);
  EXPECT_EQ(rt::joint_pulse_us(servo, 9.0, 1500), 500.0);
  EXPECT_EQ(rt::joint_pulse_us(servo, -kInfinity, 1500), 2500.0);
  EXPECT_EQ(rt::joint_pulse_us(servo, kNan, 1234.0), 1234.0);
  const GripperModel gripper{4, 1900.0, 1100.0, 0.5};
  EXPECT_DOUBLE_EQ(rt::gripper_pulse_us(gripper, 0.25, 0), 1700.0);
  EXPECT_EQ(rt::gripper_pulse_us(gripper, -1.0, 0), 1900.0);
  EXPECT_EQ(rt::gripper_pulse_us(gripper, kInfinity, 0), 1100.0);
  EXPECT_EQ(rt::gripper_pulse_us(gripper, kNan, 1111.0), 1111.0);
}

TEST(ServoMap, PutsTheGripperBehindTheJoints) {
  ServoFrame frame;
  rt::map_to_pulses(shipped_lynx5(), {0.1, 0.2, 0.3, 0.4}, 1.0, frame);
  EXPECT_EQ(frame.servo_count, 5u);
  EXPECT_EQ(frame.channel[4], 4u);
  EXPECT_DOUBLE_EQ(frame.pulse_us[4], 1100.0);
  EXPECT_EQ(frame.position_q[3], 0.4);
}

class SetPointCheck : public ::testing::Test {
 protected:
  rt::SetPointVerdict check(const Joints& next, double opening = 0.0) const {
    return rt::check_set_point(arm, last, next, opening, 1e-3);
  }
  ArmModel arm = shipped_lynx5();
  Joints last{0.1, 0.9, 1.2, 0.4};
};

static_assert(rt::kGateTolerance_q <= 2.5e-7, "far below a servo pulse, or the range is a wider one");

TEST_F(SetPointCheck, AcceptsRestAndTheSpeedLimit) {
  EXPECT_TRUE(check(last).ok);
  Joints next = last;
  next[0] += arm.joints[0].speed_q_s * 1e-3;
  EXPECT_TRUE(check(next).ok);
  EXPECT_TRUE(check(last, 1.0).ok);
}

TEST_F(SetPointCheck, RefusesAStepBeyondTheSpeedLimit) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (const double sign : {-1.0, 1.0}) {
      Joints next = last;
      next[i] += sign * (arm.joints[i].speed_q_s * 1e-3 * 1.000002 + 2e-7);
      const auto verdict = check(next);
      EXPECT_FALSE(verdict.ok);
      EXPECT_EQ(verdict.alarm.code, AlarmCode::kSetPointDiscontinuous);
      EXPECT_EQ(verdict.alarm.joint, static_cast<int>(i));
    }
  }
}

TEST_F(SetPointCheck, RefusesWhatIsNotFiniteOrOutOfRange) {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    for (const double hostile : {kNan, kInfinity, -kInfinity}) {
      Joints next = last;
      next[i] = hostile;
      EXPECT_EQ(check(next).alarm.code, AlarmCode::kSetPointNotFinite);
      EXPECT_FALSE(check(next).ok);
    }
    for (const double hostile : {1e308, -1e308, 4.0, -4.0}) {
      Joints next = last;
      next[i] = hostile;
      EXPECT_EQ(check(next).alarm.code, AlarmCode::kSetPointOutOfRange);
      EXPECT_FALSE(check(next).ok);
    }
  }
  EXPECT_FALSE(check(last, kNan).ok);
  EXPECT_FALSE(check(last, 1.1).ok);
  EXPECT_FALSE(check(last, -0.1).ok);
  last[1] = arm.joints[1].upper_q;
  Joints edge = last;
  edge[1] += 0.9 * rt::kGateTolerance_q;
  EXPECT_TRUE(check(edge).ok);
  edge[1] += 0.2 * rt::kGateTolerance_q;
  EXPECT_FALSE(check(edge).ok);
}

TEST(ServoModel, SlewsAtItsRate) {
  sim::ServoModel servo({1000.0, 0.0, 0.0, 1.0}, 1500.0);
  servo.set_pulse(1600.0);
  servo.step(0.05);
  EXPECT_DOUBLE_EQ(servo.position_us(), 1550.0);
  servo.step(0.1);
  EXPECT_DOUBLE_EQ(servo.position_us(), 1600.0);
}

TEST(ServoModel, LagsExponentially) {
  sim::ServoModel servo({1e9, 0.0, 0.1, 0.0}, 1500.0);
  servo.set_pulse(1600.0);
  servo.step(0.1);
  EXPECT_NEAR(servo.position_us(), 1600.0 - 100.0 * std::exp(-1.0), 1e-9);
}

TEST(ServoModel, IgnoresItsDeadBandButAddsUpSmallSteps) {
  sim::ServoModel servo({1e9, 4.0, 0.0, 1.0}, 1500.0);
  for (int i = 1; i <= 4; ++i) {
    servo.set_pulse(1500.0 + i);
    servo.step(0.02);
    EXPECT_EQ(servo.position_us(), 1500.0);
  }
  servo.set_pulse(1505.0);
  servo.step(0.02);
  EXPECT_EQ(servo.position_us(), 1505.0);
}

TEST(ServoModel, TakesPulsesInItsResolutionAndNoNan) {
  sim::ServoModel servo({1e9, 0.0, 0.0, 1.0}, 1500.0);
  servo.set_pulse(1510.4);
  EXPECT_EQ(servo.target_us(), 1510.0);
  servo.set_pulse(kNan);
  EXPECT_EQ(servo.target_us(), 1510.0);
}

TEST(LoopbackBackend, TakesTheNewestPulsesFiftyTimesASecond) {
  rt::LoopbackBackend backend(shipped_lynx5(), {});
  ServoFrame frame;
  rt::map_to_pulses(shipped_lynx5(), {}, 0.0, frame);
  backend.open(frame);
  for (int i = 0; i < 1000; ++i) {
    frame.cycle = static_cast<std::uint64_t>(i);
    frame.time_ns = std::int64_t{i} * 1'000'000;
    frame.pulse_us[0] = 1500.0 + 0.1 * i;
    backend.write(frame);
  }
  ASSERT_EQ(backend.frame_count(), 50u);
  for (std::uint64_t i = 0; i < 50; ++i) {
    EXPECT_EQ(backend.recorded(i).time_ns, static_cast<std::int64_t>(i) * 20'000'000);
    EXPECT_DOUBLE_EQ(backend.recorded(i).pulse_us[0], 1500.0 + 2.0 * static_cast<double>(i));
  }
}

TEST(LoopbackBackend, AfterAGapThereIsNoBurst) {
  rt::LoopbackBackend backend(shipped_lynx5(), {});
  ServoFrame frame;
  rt::map_to_pulses(shipped_lynx5(), {}, 0.0, frame);
  backend.open(frame);
  for (const std::int64_t ms : {0, 10, 20, 500, 501, 502, 519, 520, 540}) {
    frame.time_ns = ms * 1'000'000;
    backend.write(frame);
  }
  EXPECT_EQ(backend.frame_count(), 5u);  // 0, 20, 500, 520, 540
}

TEST(LoopbackBackend, ReadsBackTheServosAndTellsItsHealth) {
  rt::LoopbackSettings settings;
  settings.readback = true;
  rt::LoopbackBackend backend(shipped_lynx5(), settings);
  EXPECT_EQ(backend.health(), BackendHealth::kClosed);
  ServoFrame frame;
  const Joints there{0.2, 0.3, 0.4, 0.5};
  rt::map_to_pulses(shipped_lynx5(), there, 0.0, frame);
  backend.open(frame);
  EXPECT_EQ(backend.health(), BackendHealth::kOpen);
  backend.write(frame);
  const ServoFeedback feedback = backend.read();
  ASSERT_TRUE(feedback.measured);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(feedback.position_q[i], there[i], 1e-2);
  backend.set_plugged(false);
  EXPECT_EQ(backend.health(), BackendHealth::kLost);
  backend.close();
  backend.close();
  EXPECT_EQ(backend.health(), BackendHealth::kClosed);
}

}  // namespace
}  // namespace corbot::test::parts_test
