// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "sim_devices/device_bench.h"

namespace corbot::sim::maestro_protocol_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

/// Computes the maker's CRC-7 as on paper. The bits run from the lowest of the first byte on, with seven
/// zeros after them. They are divided by 10001001, and the remainder is read with its first bit lowest.
std::uint8_t crc7(const Bytes& message) {
  std::vector<int> bits;
  for (const std::uint8_t byte : message) {
    for (int bit = 0; bit < 8; ++bit) bits.push_back(byte >> bit & 1);
  }
  const std::size_t length = bits.size();
  bits.insert(bits.end(), 7, 0);
  constexpr int kPolynomial[] = {1, 0, 0, 0, 1, 0, 0, 1};
  for (std::size_t i = 0; i < length; ++i) {
    for (std::size_t k = 0; bits[i] != 0 && k < 8; ++k) {
      if (k > 0) bits[i + k] ^= kPolynomial[k];
    }
  }
  int crc = 0;
  for (std::size_t k = 0; k < 7; ++k) crc |= bits[length + k] << k;
  return static_cast<std::uint8_t>(crc);
}

Bytes with_crc(Bytes message) {
  message.push_back(crc7(message));
  return message;
}

TEST(MaestroProtocol, SetTargetInQuarterMicroseconds) {
  MaestroBench bench;
  EXPECT_EQ(bench.pulse_us(2, 0), 0.0);
  bench.send({0x84, 2, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(2, 20), 1500.0);
  bench.send({0x84, 2, 0x71, 0x2E}, 20);
  EXPECT_EQ(bench.pulse_us(2, 40), 1500.25);
  bench.send({0x84, 2, 0, 0}, 40);
  EXPECT_EQ(bench.pulse_us(2, 60), 0.0);
  EXPECT_EQ(bench.device.errors(), 0u);
}

TEST(MaestroProtocol, PulsesLeaveInFramesOf50Hz) {
  MaestroBench bench;
  bench.send({0x84, 2, 0x70, 0x2E}, 5);
  EXPECT_EQ(bench.pulse_us(2, 19), 0.0);
  EXPECT_EQ(bench.pulse_us(2, 20), 1500.0);
}

TEST(MaestroProtocol, SetMultipleTargets) {
  MaestroBench bench;
  bench.send({0x84, 3, 0x70, 0x2E}, 0);
  bench.send({0x9F, 2, 3, 0, 0, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(3, 20), 0.0);
  EXPECT_EQ(bench.pulse_us(4, 20), 1500.0);
  bench.send({0xAA, 12, 0x1F, 2, 22, 0x70, 0x2E, 0x71, 0x2E}, 20);
  EXPECT_EQ(bench.pulse_us(22, 40), 1500.0);
  EXPECT_EQ(bench.pulse_us(23, 40), 1500.25);
  EXPECT_EQ(bench.device.errors(), 0u);
}

TEST(MaestroProtocol, AMicroMaestroHasSixChannelsAndOneTargetACommand) {
  MaestroBench bench({.channels = 6, .multi_target = false});
  bench.send({0x84, 5, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(5, 20), 1500.0);
  EXPECT_EQ(bench.device.errors(), 0u);
  bench.send({0x9F, 2, 3, 0x70, 0x2E, 0x70, 0x2E}, 20);
  EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialProtocolError);
  EXPECT_EQ(bench.pulse_us(3, 40), 0.0);
  EXPECT_EQ(bench.pulse_us(5, 40), 0.0) << "gone home";
}

TEST(MaestroProtocol, PololuProtocolAddressesABoard) {
  MaestroBench bench;
  bench.send({0xAA, 12, 0x04, 0, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(0, 20), 1500.0);
  bench.send({0xAA, 13, 0x04, 0, 0x70, 0x20, 0xAA, 13, 0x21, 0xAA, 13, 0x7F, 1, 2, 3}, 20);
  EXPECT_EQ(bench.pulse_us(0, 40), 1500.0);
  EXPECT_EQ(bench.answers(1000), "");
  EXPECT_EQ(bench.device.errors(), 0u);
}

TEST(MaestroProtocol, BaudByteIsTakenWhereItIsToBeDetected) {
  MaestroBench bench({.detects_baud = true});
  bench.send({0xAA, 0x84, 0, 0x70, 0x2E, 0xAA, 0xAA, 12, 0x04, 1, 0x70, 0x2E, 0xAA, 0xFF, 2, 127}, 0);
  EXPECT_EQ(bench.pulse_us(0, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(2, 20), 1500.0);
  EXPECT_EQ(bench.device.errors(), 0u);
}

TEST(MaestroProtocol, MiniSscMovesAroundNeutral) {
  MaestroBench bench;
  bench.send({0xFF, 0, 127, 0xFF, 1, 0, 0xFF, 2, 254, 0xFF, 200, 127}, 0);
  EXPECT_EQ(bench.pulse_us(0, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(1, 20), 1023.75);
  EXPECT_EQ(bench.pulse_us(2, 20), 1976.25);
  EXPECT_EQ(bench.device.errors(), 0u);
  bench.send({0xFF, 1, 0xFF, 1, 127}, 20);
  EXPECT_EQ(bench.pulse_us(1, 40), 1500.0);
  EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialProtocolError);

  MaestroOptions second;
  second.mini_ssc_offset = 24;
  MaestroBench other(second);
  other.send({0xFF, 0, 127, 0xFF, 25, 127}, 0);
  EXPECT_EQ(other.pulse_us(0, 20), 0.0);
  EXPECT_EQ(other.pulse_us(1, 20), 1500.0);
}

TEST(MaestroProtocol, GetPositionAnswersTwoBytes) {
  MaestroBench bench;
  EXPECT_EQ(bench.ask("\x90\x02", 0), bytes({0, 0}));
  bench.send({0x84, 2, 0x70, 0x2E}, 1000);
  EXPECT_EQ(bench.ask("\x90\x02", 1000), bytes({0x70, 0x17}));
  EXPECT_EQ(bench.ask("\xAA\x0C\x10\x02", 3000), bytes({0x70, 0x17}));
}

TEST(MaestroProtocol, AnswersLeaveAtTheSpeedOfTheLine) {
  MaestroOptions options;
  options.baud = 9600;
  MaestroBench bench(options);
  bench.send({0xA1}, 0);
  EXPECT_EQ(bench.answers(1.0), "");
  EXPECT_EQ(bench.answers(1.1).size(), 1u);
  EXPECT_EQ(bench.answers(2.0), "");
  EXPECT_EQ(bench.answers(2.1).size(), 1u);
  EXPECT_FALSE(bench.device.next_answer_ns().has_value());
}

TEST(MaestroProtocol, GetErrorsClears) {
  MaestroBench bench;
  EXPECT_EQ(bench.ask("\xA1", 0), bytes({0, 0}));
  bench.send({0x85}, 1000);
  EXPECT_EQ(bench.ask("\xA1", 1000), bytes({0x10, 0}));
  EXPECT_EQ(bench.ask("\xA1", 2000), bytes({0, 0}));
}

TEST(MaestroProtocol, NonsenseIsAProtocolError) {
  const std::vector<Bytes> nonsense{
      {0x85, 1, 2, 3},              // no such command
      {0x84, 1, 0x70, 0x84},        // interrupted by another
      {0xAA, 12, 0x04, 1, 0x90},    // likewise
      {0xAA, 12, 0x90},             // likewise
      {0xAA, 12, 0x05, 1, 2, 3},    // no such command
      {0x05},                       // data of nothing
      {0x84, 24, 0x70, 0x2E},       // no such channel
      {0x90, 127},                  // no such channel
      {0x9F, 0, 0},                 // no targets
      {0x9F, 25},                   // more than there are channels
      {0x9F, 2, 23, 0, 16, 0, 16},  // the last beyond the channels
  };
  for (const Bytes& message : nonsense) {
    MaestroBench bench;
    bench.send_bytes(message, 0);
    EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialProtocolError) << testing::PrintToString(message);
    EXPECT_EQ(bench.answers(1000), "") << testing::PrintToString(message);
    for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(bench.pulse_us(i, 1000), 0.0);
  }
}

TEST(MaestroProtocol, RecoversAfterNonsense) {
  MaestroBench bench;
  bench.send({0x01, 0x02, 0x85, 0x03, 0x84, 0x00, 0x84, 0x01, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 1500.0);
}

TEST(MaestroProtocol, AnErrorSendsTheServosHome) {
  MaestroBench bench;
  bench.send({0x84, 1, 0x70, 0x2E, 0x85}, 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 0.0);

  MaestroOptions options;
  options.home_us = 1200.0;
  MaestroBench homing(options);
  homing.send({0x84, 1, 0x70, 0x2E, 0x85}, 0);
  EXPECT_EQ(homing.pulse_us(1, 20), 1200.0);

  options.errors_go_home = false;
  MaestroBench ignoring(options);
  ignoring.send({0x84, 1, 0x70, 0x2E, 0x85}, 0);
  EXPECT_EQ(ignoring.pulse_us(1, 20), 1500.0);
}

TEST(MaestroProtocol, CrcOfTheMakersExample) { EXPECT_EQ(crc7({0x83, 0x01}), 0x17); }

TEST(MaestroProtocol, RightCrcIsTaken) {
  MaestroOptions options;
  options.crc = true;
  MaestroBench bench(options);
  bench.send_bytes(with_crc({0x84, 1, 0x70, 0x2E}), 0);
  bench.send_bytes(with_crc({0xAA, 12, 0x04, 2, 0x70, 0x2E}), 0);
  bench.send_bytes(with_crc({0x9F, 2, 3, 0x70, 0x2E, 0x71, 0x2E}), 0);
  bench.send_bytes(with_crc({0x84, 5, 0x70, 0x2E}), 0);
  bench.send({0xFF, 6, 127}, 0);  // has none
  for (const std::size_t channel : {1u, 2u, 3u, 5u, 6u})
    EXPECT_EQ(bench.pulse_us(channel, 20), 1500.0) << channel;
  EXPECT_EQ(bench.pulse_us(4, 20), 1500.25);
  bench.send_bytes(with_crc({0xA1}), 20);
  EXPECT_EQ(bench.answers(1000), bytes({0, 0}));
}

TEST(MaestroProtocol, WrongCrcIsAnErrorAndTheCommandIgnored) {
  MaestroOptions options;
  options.crc = true;
  for (int bit = 0; bit < 7; ++bit) {
    MaestroBench bench(options);
    Bytes message = with_crc({0x84, 1, 0x70, 0x2E});
    message.back() = static_cast<std::uint8_t>(message.back() ^ 1 << bit);
    bench.send_bytes(message, 0);
    EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialCrcError);
    EXPECT_EQ(bench.pulse_us(1, 20), 0.0);
    bench.send_bytes(with_crc({0xA1}), 20);
    EXPECT_EQ(bench.answers(1000), bytes({0x08, 0}));
  }
}

TEST(MaestroProtocol, WithoutCrcACommandIsIncomplete) {
  MaestroOptions options;
  options.crc = true;
  MaestroBench bench(options);
  bench.send({0x84, 1, 0x70, 0x2E}, 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 0.0);
  bench.send({0x84, 1, 0x70, 0x2E}, 20);
  EXPECT_EQ(bench.device.errors(), MaestroDevice::kSerialProtocolError);
}

}  // namespace
}  // namespace corbot::sim::maestro_protocol_test
