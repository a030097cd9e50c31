// SPDX-License-Identifier: Apache-2.0
// Checks the bytes that the serial backends put on the wire against the makers' manuals.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "rt/backends/serial/maestro.h"
#include "rt/backends/serial/mini_ssc.h"
#include "rt/backends/serial/ssc32.h"
#include "support/cases.h"

namespace corbot::rt {
namespace {

using ::testing::ElementsAre;

ServoFrame frame_of(std::initializer_list<std::pair<std::uint32_t, double>> servos) {
  ServoFrame frame;
  for (const auto& [channel, pulse_us] : servos) {
    frame.channel[frame.servo_count] = channel;
    frame.pulse_us[frame.servo_count++] = pulse_us;
  }
  return frame;
}

TEST(Ssc32Encoding, WritesGroupMoves) {
  const ServoFrame frame = frame_of({{5, 1600.0}, {17, 750.4}, {2, 2250.5}});
  EXPECT_EQ(Ssc32::group(frame, 0), "#5P1600#17P750#2P2251\r");
  EXPECT_EQ(Ssc32::group(frame, 2000), "#5P1600#17P750#2P2251T2000\r");
}

TEST(Ssc32Encoding, BoundsPulses) {
  EXPECT_EQ(Ssc32::group(frame_of({{0, 0.0}, {1, 9999.0}}), 0), "#0P500#1P2500\r");
}

TEST(Ssc32Encoding, KnowsItsModels) {
  EXPECT_EQ(Ssc32::model_of("SSC32-V2.50USB"), "SSC-32U (SSC32-V2.50USB)");
  EXPECT_EQ(Ssc32::model_of("SSC32-1.06XE"), "SSC-32 (SSC32-1.06XE)");
  for (const char* other : {"", "Maestro", "ssc", "xSSC32"}) EXPECT_EQ(Ssc32::model_of(other), "") << other;
  EXPECT_EQ(Ssc32::model_of("SSC32\x80\x01"), "");
}

TEST(Ssc32Encoding, NeverAsksMoreOfTheLineThanItCarries) {
  for (const int baud : {2400, 9600, 38400, 115200}) {
    for (std::size_t servos = 1; servos <= kMaxServos; ++servos) {
      ServoFrame frame;
      frame.servo_count = static_cast<std::uint32_t>(servos);
      frame.channel.fill(31);
      frame.pulse_us.fill(2500.0);
      const auto line_ns = static_cast<std::int64_t>(static_cast<double>(Ssc32::group(frame, 65535).size()) *
                                                     10.0 / baud * 1e9);
      EXPECT_GE(Ssc32::shortest_period_ns(servos, baud, false), line_ns) << baud << " baud, " << servos;
      EXPECT_GT(Ssc32::shortest_period_ns(servos, 2400, true),
                Ssc32::shortest_period_ns(servos, 2400, false));
    }
  }
  // The figures of the manual's factory setting and of the usual one.
  EXPECT_EQ(Ssc32::shortest_period_ns(5, 115200, false), 20'000'000);
  EXPECT_EQ(Ssc32::shortest_period_ns(5, 115200, true, true), 20'000'000);
  EXPECT_GT(Ssc32::shortest_period_ns(5, 9600, false), 41'700'000);
}

TEST(MaestroEncoding, SetsTargetsInQuartersOfAMicrosecond) {
  const Maestro maestro({"/dev/null", 115200, -1, false, false, 2, false});
  // 1500 us = 6000 = 0x70 + 0x2E * 128, the manual's own example.
  EXPECT_THAT(maestro.targets(frame_of({{2, 1500.0}})), ElementsAre(0x84, 2, 0x70, 0x2E));
  EXPECT_THAT(maestro.targets(frame_of({{2, 1500.0}, {4, 1500.0}})),
              ElementsAre(0x84, 2, 0x70, 0x2E, 0x84, 4, 0x70, 0x2E));
  EXPECT_THAT(maestro.targets(frame_of({{3, 1500.0}, {4, 1500.25}})),
              ElementsAre(0x84, 3, 0x70, 0x2E, 0x84, 4, 0x71, 0x2E))
      << "as a Micro Maestro supports it";
  const Maestro mini({"/dev/null", 115200, -1, false, false, 2, true});
  EXPECT_THAT(mini.targets(frame_of({{2, 1500.0}, {4, 1500.0}})),
              ElementsAre(0x84, 2, 0x70, 0x2E, 0x84, 4, 0x70, 0x2E));
  EXPECT_THAT(mini.targets(frame_of({{3, 1500.0}, {4, 1500.25}})),
              ElementsAre(0x9F, 2, 3, 0x70, 0x2E, 0x71, 0x2E))
      << "channels in a row in one command";
}

TEST(MaestroEncoding, AddressesABoardAndAddsTheCheck) {
  const Maestro addressed({"/dev/null", 115200, 12, false, false, 1, false});
  EXPECT_THAT(addressed.command(0x84, {0, 0x70, 0x2E}), ElementsAre(0xAA, 0x0C, 0x04, 0, 0x70, 0x2E));
  // The example of the manual's section on the cyclic redundancy check: 0x83, 0x01 -> 0x17.
  EXPECT_EQ(Maestro::crc7({0x83, 0x01}), 0x17);
  const Maestro checked({"/dev/null", 115200, -1, true, false, 1, false});
  EXPECT_THAT(checked.command(0x83, {0x01}), ElementsAre(0x83, 0x01, 0x17));
}

TEST(MaestroEncoding, NamesErrors) {
  EXPECT_EQ(Maestro::describe_errors(0), "");
  EXPECT_EQ(Maestro::describe_errors(0x08 | 0x20), "serial CRC, serial timeout");
}

TEST(MiniSscEncoding, TakesTheNearestOf255Positions) {
  const MiniSsc whole({"/dev/null", 9600, 500.0, 2500.0, 5});
  EXPECT_EQ(whole.position_of(500.0), 0);
  EXPECT_EQ(whole.position_of(1500.0), 127);
  EXPECT_EQ(whole.position_of(2500.0), 254);
  EXPECT_EQ(whole.position_of(0.0), 0);
  EXPECT_EQ(whole.position_of(9999.0), 254);
}

TEST(Encoding, IsWithinHalfAUnit) {
  std::mt19937_64 random(test::drawn_seed());
  std::uniform_real_distribution<double> pulse(500.0, 2500.0);
  const Maestro maestro({"/dev/null", 115200, -1, false, false, 1, false});
  const MiniSsc mini({"/dev/null", 9600, 500.0, 2500.0, 1});
  for (int i = 0; i < 100'000; ++i) {
    const double wanted_us = pulse(random);
    const std::string group = Ssc32::group(frame_of({{0, wanted_us}}), 0);
    EXPECT_LE(std::abs(std::stod(group.substr(3)) - wanted_us), 0.5 + 1e-9);
    const auto target = maestro.targets(frame_of({{0, wanted_us}}));
    EXPECT_LE(std::abs((target[2] + 128.0 * target[3]) / 4.0 - wanted_us), 0.125 + 1e-9);
    const double unit_us = 2000.0 / 254.0;
    EXPECT_LE(std::abs(500.0 + unit_us * mini.position_of(wanted_us) - wanted_us), unit_us / 2 + 1e-9);
  }
}

}  // namespace
}  // namespace corbot::rt
