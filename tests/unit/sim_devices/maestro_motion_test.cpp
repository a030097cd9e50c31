// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim_devices/device_bench.h"

namespace corbot::sim::maestro_motion_test {
namespace {

/// A command with a channel and a 14-bit value.
void set(MaestroBench& bench, std::uint8_t command, std::uint8_t channel, int value, double at_ms) {
  bench.send(
      {command, channel, static_cast<std::uint8_t>(value & 0x7F), static_cast<std::uint8_t>(value >> 7)},
      at_ms);
}

void set_target(MaestroBench& bench, std::uint8_t channel, double us, double at_ms) {
  set(bench, 0x84, channel, static_cast<int>(us * 4), at_ms);
}

bool is_moving(MaestroBench& bench, double at_ms) {
  bench.send({0x93}, at_ms);
  const std::string answer = bench.answers(at_ms + 1.0);
  EXPECT_EQ(answer.size(), 1u);
  return answer == std::string(1, '\1');
}

TEST(MaestroMotion, WithoutLimitsItJumps) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set_target(bench, 5, 2000, 20);
  EXPECT_FALSE(is_moving(bench, 20));
  EXPECT_EQ(bench.pulse_us(5, 40), 2000.0);
}

TEST(MaestroMotion, SpeedExampleOfTheManual) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  bench.send({0x87, 5, 0x0C, 0x01}, 0);  // 140: 3.5 us a ms
  set_target(bench, 5, 1350, 20);
  EXPECT_TRUE(is_moving(bench, 20));
  EXPECT_EQ(bench.pulse_us(5, 40), 1070.0);
  EXPECT_EQ(bench.pulse_us(5, 100), 1280.0);
  EXPECT_TRUE(is_moving(bench, 118));
  EXPECT_FALSE(is_moving(bench, 120));
  EXPECT_EQ(bench.pulse_us(5, 120), 1350.0);
  set_target(bench, 5, 1000, 200);
  EXPECT_EQ(bench.pulse_us(5, 220), 1280.0);
}

TEST(MaestroMotion, SlowestSpeedTakesFortySecondsForAMillisecond) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x87, 5, 1, 0);
  set_target(bench, 5, 2000, 0);
  EXPECT_TRUE(is_moving(bench, 39'980));
  EXPECT_FALSE(is_moving(bench, 40'000));
  set_target(bench, 5, 1000, 50'000);
  EXPECT_EQ(bench.pulse_us(5, 365.0 * 86'400e3), 1000.0);  // and a long silence is no work
}

TEST(MaestroMotion, AccelerationStartsAndStopsGently) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x89, 5, 4, 0);
  set_target(bench, 5, 2000, 20);
  double before_us = 1000.0;
  double step_us = 0.0;
  double fastest_us = 0.0;
  double at_ms = 20;
  for (; is_moving(bench, at_ms); at_ms += 20) {
    const double now_us = bench.pulse_us(5, at_ms + 2);
    EXPECT_GE(now_us, before_us);
    EXPECT_LE(now_us, 2000.0);
    // 4 · 0.25 us / 10 ms / 80 ms: in a frame of 20 ms the step changes by 0.5 us, and by rounding.
    EXPECT_NEAR(now_us - before_us, step_us, 0.5 + 0.5) << at_ms;
    step_us = now_us - before_us;
    fastest_us = std::max(fastest_us, step_us);
    before_us = now_us;
  }
  EXPECT_EQ(bench.pulse_us(5, at_ms + 20), 2000.0);
  EXPECT_NEAR(at_ms - 20.0, 2.0 * std::sqrt(1000.0 / 12.5e-4), 60.0);  // 12.5 us a second per 10 ms
  EXPECT_NEAR(fastest_us, 20.0 * std::sqrt(1000.0 * 12.5e-4), 1.0);
}

TEST(MaestroMotion, AccelerationKeepsTheSpeedLimit) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x89, 5, 50, 0);
  set(bench, 0x87, 5, 40, 0);  // 1 us a ms
  set_target(bench, 5, 2000, 0);
  double before_us = 1000.0;
  for (double at_ms = 20; at_ms <= 1200; at_ms += 20) {
    const double now_us = bench.pulse_us(5, at_ms);
    EXPECT_LE(now_us - before_us, 20.0);
    before_us = now_us;
  }
  EXPECT_EQ(before_us, 2000.0);
}

TEST(MaestroMotion, ANewTargetBehindIsReachedAfterBraking) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x89, 5, 2, 0);
  set_target(bench, 5, 2000, 0);
  const double turn_us = bench.pulse_us(5, 600);
  set_target(bench, 5, 1000, 600);
  EXPECT_GT(bench.pulse_us(5, 660), turn_us);
  EXPECT_FALSE(is_moving(bench, 10'000));
  EXPECT_EQ(bench.pulse_us(5, 10'020), 1000.0);
}

TEST(MaestroMotion, ATargetTooNearToStopIsOvershot) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x89, 5, 2, 0);
  set_target(bench, 5, 2000, 0);
  const double at_us = bench.pulse_us(5, 600);
  set_target(bench, 5, at_us + 5, 600);
  EXPECT_GT(bench.pulse_us(5, 660), at_us + 10);
  EXPECT_FALSE(is_moving(bench, 10'000));
  EXPECT_EQ(bench.pulse_us(5, 10'020), at_us + 5);
}

TEST(MaestroMotion, OvershootStaysWithinTheLimits) {
  MaestroOptions options;
  options.min_us = 992.0;
  MaestroBench bench(options);
  set_target(bench, 5, 1900, 0);
  set(bench, 0x89, 5, 255, 0);
  set_target(bench, 5, 1000, 0);
  EXPECT_LT(bench.pulse_us(5, 100), 1800.0);
  set(bench, 0x89, 5, 1, 100);  // can no longer brake in time
  set_target(bench, 5, 1990, 100);
  double least_us = 1900.0;
  for (double at_ms = 100; at_ms < 5000; at_ms += 20) least_us = std::min(least_us, bench.pulse_us(5, at_ms));
  EXPECT_EQ(least_us, 992.0);
  EXPECT_EQ(bench.pulse_us(5, 5000), 1990.0);
}

TEST(MaestroMotion, FirstTargetIsTakenAtOnceWhateverTheLimits) {
  MaestroBench bench;
  set(bench, 0x87, 5, 1, 0);
  set_target(bench, 5, 2000, 0);
  EXPECT_EQ(bench.pulse_us(5, 20), 2000.0);
  set_target(bench, 5, 0, 20);
  EXPECT_EQ(bench.pulse_us(5, 40), 0.0);
  set_target(bench, 5, 1000, 40);
  EXPECT_EQ(bench.pulse_us(5, 60), 1000.0);
}

TEST(MaestroMotion, TargetsAreClippedToTheRangeOfTheChannels) {
  MaestroOptions options;
  options.min_us = 992.0;
  options.max_us = 2000.0;
  MaestroBench bench(options);
  set_target(bench, 5, 900, 0);
  EXPECT_EQ(bench.pulse_us(5, 20), 992.0);
  set_target(bench, 5, 2100, 20);
  EXPECT_EQ(bench.pulse_us(5, 40), 2000.0);
}

TEST(MaestroMotion, GetPositionTellsWhereItIsNow) {
  MaestroBench bench;
  set_target(bench, 5, 1000, 0);
  set(bench, 0x87, 5, 140, 0);
  set_target(bench, 5, 1350, 0);
  bench.send({0x90, 5}, 50);
  const std::string answer = bench.answers(55);
  ASSERT_EQ(answer.size(), 2u);
  EXPECT_EQ(static_cast<std::uint8_t>(answer[0]) | static_cast<std::uint8_t>(answer[1]) << 8, 4 * 1175);
}

TEST(MaestroMotion, GoHome) {
  MaestroBench bench;
  set_target(bench, 1, 1500, 0);
  set_target(bench, 2, 1500, 0);
  bench.send({0xA2}, 20);
  EXPECT_EQ(bench.pulse_us(1, 40), 0.0);
  EXPECT_EQ(bench.pulse_us(2, 40), 0.0);
  EXPECT_EQ(bench.device.errors(), 0u);

  MaestroOptions options;
  options.home_us = 1200.0;
  MaestroBench homing(options);
  homing.send({0xAA, 12, 0x22}, 0);
  EXPECT_EQ(homing.pulse_us(23, 20), 1200.0);
}

TEST(MaestroMotion, ShaftFollows) {
  MaestroBench bench;
  EXPECT_EQ(bench.shaft_us(1, 0), 1500.0);
  set_target(bench, 1, 1740, 0);
  EXPECT_NEAR(bench.shaft_us(1, 70), 1620.0, 1e-6);
  EXPECT_NEAR(bench.shaft_us(1, 1000), 1740.0, 1e-6);
}

TEST(MaestroMotion, PowerCycle) {
  MaestroBench bench;
  set(bench, 0x87, 1, 1, 0);
  set_target(bench, 1, 1500, 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
  bench.send({0x85, 0x84, 1}, 30);
  bench.device.power_cycle(MaestroBench::ns(30));
  EXPECT_EQ(bench.pulse_us(1, 30), 0.0);
  EXPECT_EQ(bench.device.errors(), 0u);
  set_target(bench, 1, 1000, 40);
  set_target(bench, 1, 2000, 40);
  EXPECT_EQ(bench.pulse_us(1, 60), 2000.0);
  EXPECT_FALSE(bench.device.set_input('A', true));
}

}  // namespace
}  // namespace corbot::sim::maestro_motion_test
