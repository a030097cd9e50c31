// SPDX-License-Identifier: Apache-2.0
// Tests how a Maestro's settings act: the detection of the baud, and its own time-out.
#include <gtest/gtest.h>

#include "sim_devices/device_bench.h"

namespace corbot::sim::maestro_settings_test {
namespace {

std::string bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

TEST(MaestroSettings, NothingIsTakenBeforeTheBaudIsDetected) {
  MaestroBench bench({.detects_baud = true});
  bench.send({0x84, 1, 0x70, 0x2E, 0xA1, 0x01}, 0);
  EXPECT_EQ(bench.answers(1000), "");
  EXPECT_EQ(bench.pulse_us(1, 1000), 0.0);
  EXPECT_EQ(bench.device.errors(), 0u);
  bench.send({0xAA, 0x84, 1, 0x70, 0x2E}, 1000);
  EXPECT_EQ(bench.pulse_us(1, 1020), 1500.0);
  bench.device.power_cycle(MaestroBench::ns(2000));
  bench.send({0x84, 1, 0x70, 0x2E}, 2000);
  EXPECT_EQ(bench.pulse_us(1, 2020), 0.0) << "at every power-up again";
}

TEST(MaestroSettings, TheByteOfTheDetectionIsAnErrorToABoardThatDoesNotDetect) {
  MaestroBench bench;
  bench.send({0x84, 1, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
  bench.send({0xAA, 0xA1}, 20);
  EXPECT_EQ(bench.answers(1000), bytes({0x10, 0}));
  EXPECT_EQ(bench.pulse_us(1, 1000), 0.0) << "and sends the servos home";
}

TEST(MaestroSettings, ATimeOutIsAnErrorAndSendsTheServosHome) {
  MaestroBench bench({.timeout_ms = 500});
  bench.send({0x84, 1, 0x70, 0x2E}, 0);
  for (int ms = 400; ms <= 2000; ms += 400) bench.send({0x90, 1}, ms);  // any valid command will do
  (void)bench.answers(2010);
  EXPECT_EQ(bench.pulse_us(1, 2000), 1500.0);
  EXPECT_EQ(bench.device.errors(), 0u);
  EXPECT_EQ(bench.pulse_us(1, 2480), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 2540), 0.0);
  EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialTimeout);
  bench.send({0xA1}, 2600);
  EXPECT_EQ(bench.answers(2700), bytes({0x20, 0}));
}

TEST(MaestroSettings, NoTimeOutUnlessSet) {
  MaestroBench bench;
  bench.send({0x84, 1, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(1, 3'600'000), 1500.0);
  EXPECT_EQ(bench.device.errors(), 0u);
}

}  // namespace
}  // namespace corbot::sim::maestro_settings_test
