// SPDX-License-Identifier: Apache-2.0
#include "config/load_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>

#include "config/arms/four_axis.h"
#include "support/paths.h"

namespace corbot::profile_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const std::string kProfiles = CORBOT_PROFILES;

/// The arm of the paper's table with these lengths, axis by axis.
void expect_lengths(const ArmModel& arm, const config::FourAxisLengths& lengths) {
  const JointChain chain = joint_chain(config::four_axis_table(lengths));
  ASSERT_EQ(arm.kinematics.joint_count(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(arm.kinematics.chain().axes[i].point_m, chain.axes[i].point_m) << "joint " << i;
    EXPECT_EQ(arm.kinematics.chain().axes[i].direction, chain.axes[i].direction) << "joint " << i;
  }
  EXPECT_EQ(arm.kinematics.chain().zero_T_n.position_m, chain.zero_T_n.position_m);
}

TEST(ShippedProfile, Lynx5IsReadToTheLastValue) {
  const Profile profile = load_profile(kProfiles + "/lynx5.toml");
  EXPECT_EQ(profile.name, "lynx5");
  EXPECT_EQ(profile.file, kProfiles + "/lynx5.toml");
  EXPECT_EQ(profile.priority, 80);
  EXPECT_EQ(profile.cpu, -1);
  EXPECT_EQ(profile.queue_capacity, 16);
  EXPECT_EQ(profile.endpoint_host, "127.0.0.1");
  EXPECT_EQ(profile.port, 12810);
  EXPECT_EQ(profile.joint_names, (std::vector<std::string>{"base", "shoulder", "elbow", "wrist"}));
  const ArmModel& arm = profile.arm;
  EXPECT_EQ(arm.kind, ArmKind::kAnthropomorphic);
  EXPECT_EQ(arm.dof, 4u);
  EXPECT_EQ(arm.period_ns, 1'000'000);
  expect_lengths(arm, {0.067, 0.12, 0.12, 0.1, {0, 10 * kDegree, 0, -45 * kDegree}});
  EXPECT_EQ(arm.path.speed_m_s, 0.25);
  EXPECT_EQ(arm.path.acceleration_m_s2, 1.0);
  EXPECT_EQ(arm.path.jerk_m_s3, 10.0);
  EXPECT_EQ(arm.path.rotation_speed_rad_s, 90 * kDegree);
  EXPECT_EQ(arm.path.rotation_acceleration_rad_s2, 400 * kDegree);
  EXPECT_EQ(arm.path.rotation_jerk_rad_s3, 4000 * kDegree);
  EXPECT_EQ(arm.gripper.channel, 4u);
  EXPECT_EQ(arm.gripper.closed_us, 1900.0);
  EXPECT_EQ(arm.gripper.open_us, 1100.0);
  EXPECT_EQ(arm.gripper.travel_s, 0.5);
  EXPECT_EQ(profile.backend.kind, "loopback");
  EXPECT_EQ(profile.backend.loopback.frame_hz, 50.0);
  EXPECT_EQ(profile.backend.loopback.rate_us_per_s, 3500.0);
  EXPECT_EQ(profile.backend.loopback.dead_band_us, 4.0);
  EXPECT_EQ(profile.backend.loopback.lag_s, 0.02);
  EXPECT_FALSE(profile.backend.common.readback);
}

TEST(ShippedProfile, ASlowArmKeepsItsPowerUntilItsLongestStopIsOver) {
  EXPECT_EQ(load_profile(kProfiles + "/puma560.toml").stop.ramp_s, 1.0);
  EXPECT_NEAR(load_profile(kProfiles + "/cartesian_ppp.toml").stop.ramp_s, 1.86, 0.02);
}

TEST(ShippedProfile, Lynx5JointsAreConvertedExactly) {
  const ArmModel arm = load_profile(kProfiles + "/lynx5.toml").arm;
  const JointLimits& elbow = arm.joints[2];
  EXPECT_EQ(elbow.lower_q, -30 * kDegree);
  EXPECT_EQ(elbow.upper_q, 150 * kDegree);
  EXPECT_EQ(elbow.speed_q_s, 180 * kDegree);
  EXPECT_EQ(elbow.acceleration_q_s2, 900 * kDegree);
  EXPECT_EQ(elbow.jerk_q_s3, 8000 * kDegree);
  const ServoMap& servo = arm.servos[2];
  EXPECT_EQ(servo.channel, 2u);
  EXPECT_EQ(servo.zero_us, 2100.0);
  EXPECT_EQ(servo.us_per_q, 10 / kDegree);
  EXPECT_EQ(servo.direction, -1.0);
  EXPECT_EQ(servo.pulse_min_us, 500.0);
  EXPECT_EQ(servo.pulse_max_us, 2500.0);
  for (std::size_t beyond = arm.dof; beyond < kMaxJoints; ++beyond)
    EXPECT_EQ(arm.joints[beyond].upper_q, 0.0);
}

TEST(ShippedProfile, Al5dHasItsPublishedLengthsAndCalibratedCentres) {
  const Profile profile = load_profile(kProfiles + "/al5d.toml");
  const ArmModel& arm = profile.arm;
  EXPECT_EQ(profile.name, "al5d");
  expect_lengths(arm, {0.06731, 0.14605, 0.187325, 0.1, {0, 10 * kDegree, 0, -45 * kDegree}});
  const std::array<double, 4> scale{10, 8.5, 11.5, 9.9};
  const std::array<double, 4> centre{1480, 1550, 1560, 1440};
  for (std::size_t i = 0; i < 4; ++i) {
    const ServoMap& servo = arm.servos[i];
    EXPECT_EQ(servo.us_per_q, scale[i] / kDegree);
    const double middle = (arm.joints[i].lower_q + arm.joints[i].upper_q) / 2;
    EXPECT_NEAR(servo.zero_us + servo.direction * servo.us_per_q * middle, centre[i], 1e-9) << "joint " << i;
  }
}

/// The elbow must be able to take both signs, or half of the closed-form branches could never be used.
TEST(ShippedProfile, ElbowsBendBothWays) {
  for (const char* name : {"/lynx5.toml", "/al5d.toml"}) {
    const JointLimits elbow = load_profile(kProfiles + name).arm.joints[2];
    EXPECT_LT(elbow.lower_q, -10 * kDegree) << name;
    EXPECT_GT(elbow.upper_q, 120 * kDegree) << name;
  }
}

TEST(ParseProfile, WhatMayBeLeftOutHasItsDefault) {
  std::ifstream stream{kProfiles + "/lynx5.toml"};
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  text.resize(text.find("[loop]"));
  text += "[backend]\nkind = \"loopback\"\n";
  const Profile profile = parse_profile(text, "short.toml");
  EXPECT_EQ(profile.arm.period_ns, 1'000'000);
  EXPECT_EQ(profile.priority, 80);
  EXPECT_EQ(profile.cpu, -1);
  EXPECT_EQ(profile.gap_fault_ns, 100'000'000);
  EXPECT_EQ(profile.orphan_ns, 2'000'000'000);
  EXPECT_EQ(profile.port, 12810);
  EXPECT_EQ(profile.endpoint_host, "127.0.0.1");
  EXPECT_EQ(profile.queue_capacity, 16);
  EXPECT_EQ(profile.backend.loopback.frame_hz, LoopbackOptions{}.frame_hz);
  EXPECT_TRUE(profile.watchdog.chip.empty());
  EXPECT_FALSE(switches_power(profile));
}

TEST(ParseProfile, AWatchdogSwitchesTheServosPower) {
  std::ifstream stream{kProfiles + "/lynx5.toml"};
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string watchdog = "[watchdog]\nchip = \"/dev/gpiochip3\"\nline = \"20\"\nactive = \"low\"\n";
  const Profile slow = parse_profile(text + watchdog + "period_ms = 62.5\n", "arm.toml");
  EXPECT_EQ(slow.watchdog.chip, "/dev/gpiochip3");
  EXPECT_EQ(slow.watchdog.line, "20");
  EXPECT_TRUE(slow.watchdog.active_low);
  EXPECT_EQ(slow.watchdog.period_ns, 62'500'000);
  EXPECT_TRUE(switches_power(slow));
  EXPECT_TRUE(unpowered_after_exit(slow));
  EXPECT_EQ(parse_profile(text + watchdog, "arm.toml").watchdog.period_ns, 10'000'000);
}

}  // namespace
}  // namespace corbot::profile_test
