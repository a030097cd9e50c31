// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "sim_devices/device_bench.h"

namespace corbot::sim::ssc32_moves_test {
namespace {

/// Whether the device says that it moves; takes a millisecond.
bool is_moving(Ssc32Bench& bench, double at_ms) {
  bench.send("Q\r", at_ms);
  const std::string answer = bench.answers(at_ms + 1.0);
  EXPECT_TRUE(answer == "+" || answer == ".") << answer;
  return answer == "+";
}

TEST(Ssc32Moves, NoPulseBeforeTheFirstMove) {
  Ssc32Bench bench;
  EXPECT_EQ(bench.pulse_us(0, 0), 0.0);
  bench.send("#0P1500\r", 0);
  EXPECT_EQ(bench.pulse_us(0, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 20), 0.0);
  EXPECT_EQ(bench.pulse_us(32, 20), 0.0);
}

TEST(Ssc32Moves, PulsesLeaveInFramesOf50Hz) {
  Ssc32Bench bench;
  bench.send("#0P1500\r", 0);
  EXPECT_EQ(bench.pulse_us(0, 20), 1500.0);
  bench.send("#0P1800\r", 25);
  EXPECT_EQ(bench.pulse_us(0, 39.9), 1500.0);
  EXPECT_EQ(bench.pulse_us(0, 40), 1800.0);
  bench.send("#0P2000T1000\r", 40);
  EXPECT_EQ(bench.pulse_us(0, 159), 1820.0);  // as of 140 ms
  EXPECT_EQ(bench.pulse_us(0, 160), 1824.0);
}

TEST(Ssc32Moves, ExampleOfTheManualTakesTwoAndAHalfSeconds) {
  Ssc32Bench bench;
  bench.send("#5P1500#17P2000#2P1250\r", 0);
  bench.send("#5P1600#17P750S500#2P2250T2000\r", 1000);
  EXPECT_EQ(bench.pulse_us(5, 1000), 1500.0);
  EXPECT_EQ(bench.pulse_us(5, 2260), 1550.0);
  EXPECT_EQ(bench.pulse_us(17, 2260), 1370.0);
  EXPECT_EQ(bench.pulse_us(2, 2260), 1754.0);
  EXPECT_TRUE(is_moving(bench, 3499));
  EXPECT_FALSE(is_moving(bench, 3500));
  EXPECT_EQ(bench.pulse_us(5, 3520), 1600.0);
  EXPECT_EQ(bench.pulse_us(17, 3520), 750.0);
  EXPECT_EQ(bench.pulse_us(2, 3520), 2250.0);
}

TEST(Ssc32Moves, SpeedIsACeilingAndTimeAFloor) {
  Ssc32Bench bench;
  bench.send("#1P1500\r", 0);
  bench.send("#1P1000S100T1000\r", 0);
  EXPECT_TRUE(is_moving(bench, 4990));
  EXPECT_FALSE(is_moving(bench, 5000));
  bench.send("#1P1500S1000T2000\r", 6000);
  EXPECT_TRUE(is_moving(bench, 7990));
  EXPECT_FALSE(is_moving(bench, 8000));
  EXPECT_EQ(bench.pulse_us(1, 8000), 1500.0);
}

TEST(Ssc32Moves, TheSlowestDecidesForAll) {
  Ssc32Bench bench;
  bench.send("#1P1500#2P1500#3P1500\r", 0);
  bench.send("#1P1600S100#2P1900S100#3P1700\r", 0);
  for (const double at_ms : {1000.0, 2000.0, 3000.0, 4000.0}) {
    EXPECT_EQ(bench.pulse_us(1, at_ms), 1500.0 + at_ms / 40) << at_ms;
    EXPECT_EQ(bench.pulse_us(2, at_ms), 1500.0 + at_ms / 10) << at_ms;
    EXPECT_EQ(bench.pulse_us(3, at_ms), 1500.0 + at_ms / 20) << at_ms;
  }
}

TEST(Ssc32Moves, TheLongestTimeIs65535Milliseconds) {
  Ssc32Bench bench;
  bench.send("#1P1500\r", 0);
  bench.send("#1P1600T65535\r", 0);
  EXPECT_TRUE(is_moving(bench, 65'534));
  EXPECT_FALSE(is_moving(bench, 65'536));
  bench.send("#1P1500T65536\r", 70'000);
  EXPECT_EQ(bench.device.bad_input_count(), 1u);
  EXPECT_EQ(bench.pulse_us(1, 71'000), 1600.0);
}

TEST(Ssc32Moves, PulsesHaveWholeMicroseconds) {
  Ssc32Bench bench;
  bench.send("#1P1500\r", 0);
  bench.send("#1P1507T1000\r", 0);
  for (int frame = 1; frame <= 50; ++frame) {
    EXPECT_EQ(bench.pulse_us(1, frame * 20.0), std::round(1500.0 + 7.0 * frame / 50)) << frame;
  }
}

TEST(Ssc32Moves, PlainMoveIsDoneAtOnce) {
  Ssc32Bench bench;
  bench.send("#1P1500#2P600\r", 0);
  EXPECT_FALSE(is_moving(bench, 0));
  EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(2, 20), 600.0);
}

TEST(Ssc32Moves, FirstMoveWithATimeThrowsAnOldServoTo500) {
  for (const std::string move : {"#1P1500T1000\r", "#1P1500S1000\r"}) {
    Ssc32Bench bench(older());
    bench.send(move, 0);
    EXPECT_EQ(bench.pulse_us(1, 19), 0.0);
    EXPECT_EQ(bench.pulse_us(1, 20), 520.0);
    EXPECT_EQ(bench.pulse_us(1, 500), 1000.0);
    EXPECT_EQ(bench.pulse_us(1, 1000), 1500.0);
    EXPECT_LT(bench.shaft_us(1, 1001), 1501.0);
  }
}

TEST(Ssc32Moves, FirstMoveOfTheUIgnoresSpeedAndTime) {
  for (const std::string move : {"#1P1500T1000\r", "#1P1500S10\r"}) {
    Ssc32Bench bench;
    bench.send(move, 0);
    EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
    EXPECT_FALSE(is_moving(bench, 21));
    bench.send("#1P1600T1000\r", 40);
    EXPECT_EQ(bench.pulse_us(1, 540), 1550.0);
  }
}

TEST(Ssc32Moves, FirstMoveOfOneServoLeavesTheOthersTheirTime) {
  Ssc32Bench bench;
  bench.send("#1P1500\r", 0);
  bench.send("#1P1600#2P2000S1T1000\r", 0);
  EXPECT_EQ(bench.pulse_us(2, 20), 2000.0);
  EXPECT_EQ(bench.pulse_us(1, 500), 1550.0);
  EXPECT_EQ(bench.pulse_us(1, 1000), 1600.0);
}

TEST(Ssc32Moves, OtherWidthsThan500To2500AreIgnored) {
  Ssc32Bench bench;
  bench.send("#1P500#2P2500\r", 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 500.0);
  EXPECT_EQ(bench.pulse_us(2, 20), 2500.0);
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
  bench.send("#1P499\r", 20);
  bench.send("#1P1500#2P2501\r", 20);
  EXPECT_EQ(bench.device.bad_input_count(), 2u);
  EXPECT_EQ(bench.pulse_us(1, 40), 500.0);
  EXPECT_EQ(bench.pulse_us(2, 40), 2500.0);
}

TEST(Ssc32Moves, NewMoveBeginsWhereTheServoIs) {
  Ssc32Bench bench;
  bench.send("#1P1000\r", 0);
  bench.send("#1P2000T1000\r", 0);
  bench.send("#1P1000T1000\r", 500);
  EXPECT_EQ(bench.pulse_us(1, 500), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 1000), 1250.0);
  EXPECT_EQ(bench.pulse_us(1, 1500), 1000.0);
}

TEST(Ssc32Moves, StopStopsOneServoButTheMoveCountsOn) {
  Ssc32Bench bench;
  bench.send("#1P1000#2P1000\r", 0);
  bench.send("#1P2000#2P2000T1000\r", 0);
  bench.send("STOP1\r", 500);
  EXPECT_EQ(bench.pulse_us(1, 600), 1500.0);
  EXPECT_EQ(bench.pulse_us(2, 600), 1600.0);
  bench.send("stop 2\r", 600);
  EXPECT_EQ(bench.pulse_us(2, 700), 1600.0);
  EXPECT_TRUE(is_moving(bench, 998));
  EXPECT_FALSE(is_moving(bench, 1000));
  EXPECT_EQ(bench.pulse_us(1, 2000), 1500.0);
  EXPECT_EQ(bench.pulse_us(2, 2000), 1600.0);
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
}

TEST(Ssc32Moves, TheOlderModelKnowsNoStop) {
  Ssc32Bench bench(older());
  bench.send("#1P1000\r", 0);
  bench.send("#1P2000T1000\r", 0);
  bench.send("STOP1\r", 500);
  EXPECT_EQ(bench.device.bad_input_count(), 1u);
  EXPECT_EQ(bench.pulse_us(1, 1000), 2000.0);
}

TEST(Ssc32Moves, ShaftFollowsThePulsesAtItsOwnSpeed) {
  Ssc32Options options;
  options.servo.rate_us_per_s = 1000.0;
  options.shaft_us = 1200.0;
  Ssc32Bench bench(options);
  EXPECT_EQ(bench.shaft_us(1, 0), 1200.0);
  bench.send("#1P1500\r", 0);
  EXPECT_EQ(bench.shaft_us(1, 20), 1200.0);
  EXPECT_NEAR(bench.shaft_us(1, 130), 1310.0, 1e-6);
  EXPECT_NEAR(bench.shaft_us(1, 400), 1500.0, 1e-6);
  EXPECT_EQ(bench.shaft_us(2, 400), 1200.0);
  bench.send("#1P2000\r", 400);
  bench.send("#1L\r", 520);  // no torque
  EXPECT_NEAR(bench.shaft_us(1, 600), 1620.0, 1e-6);
  EXPECT_NEAR(bench.shaft_us(1, 9000), 1620.0, 1e-6);
}

TEST(Ssc32Moves, ServoForgetsAPulseThatHasStopped) {
  Ssc32Options options;
  options.servo.rate_us_per_s = 1000.0;
  options.servo.dead_band_us = 5.0;
  Ssc32Bench bench(options);
  bench.send("#1P2000\r", 0);
  bench.send("#1L\r", 120);  // the pulses end with the frame at 140 ms: at 1620
  bench.send("#1P1622\r", 200);
  EXPECT_NEAR(bench.shaft_us(1, 1000), 1620.0, 1e-6);
}

TEST(Ssc32Moves, PowerCycleForgetsWhereTheServosAre) {
  Ssc32Bench bench(older());
  bench.send("#1P2000#2P2000\r", 0);
  bench.send("#1PO50\r", 0);
  EXPECT_EQ(bench.pulse_us(1, 1000), 2050.0);
  bench.send("VER\r#2P21", 1000);
  bench.device.power_cycle(Ssc32Bench::ns(1001));
  EXPECT_EQ(bench.pulse_us(1, 1001), 0.0);
  EXPECT_NEAR(bench.shaft_us(1, 1500), 2050.0, 1e-6);
  EXPECT_EQ(bench.answers(1500), "");
  bench.send("00\r", 1500);  // the rest of a command means nothing
  EXPECT_EQ(bench.pulse_us(2, 1600), 0.0);
  bench.send("#1P1500T1000\r", 2000);
  EXPECT_EQ(bench.pulse_us(1, 2500), 1000.0);
}

TEST(Ssc32Moves, LongSilenceIsNoWork) {
  Ssc32Bench bench;
  constexpr double kYear_ms = 365.0 * 86'400e3;
  bench.send("#1P2000\r", 0);
  EXPECT_EQ(bench.pulse_us(1, kYear_ms), 2000.0);
  EXPECT_NEAR(bench.shaft_us(1, kYear_ms), 2000.0, 1e-6);
}

TEST(Ssc32Moves, TimeDoesNotRunBackwards) {
  Ssc32Bench bench;
  bench.send("#1P1000\r", 0);
  bench.send("#1P2000T1000\r", 0);
  EXPECT_EQ(bench.pulse_us(1, 500), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 100), 1500.0);
  bench.send("STOP1\r", 100);
  EXPECT_EQ(bench.pulse_us(1, 600), 1500.0);
}

}  // namespace
}  // namespace corbot::sim::ssc32_moves_test
