// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "sim_devices/device_bench.h"
#include "support/cases.h"

namespace corbot::sim::random_input_test {
namespace {

constexpr std::int64_t kByte_ns = 86'805;

using Words = std::vector<std::string>;

/// Words of the device's language in any order, and here and there a byte that is nonsense.
template <class Device>
void shower(Device& device, const Words& words, double min_us, double max_us) {
  std::mt19937_64 random(test::seed());
  const int bytes = test::cases(1'000'000);
  std::int64_t now_ns = 1'000'000'000;
  std::size_t answered = 0;
  std::size_t pulses = 0;
  for (int sent = 0, turn = 0; sent < bytes; ++turn) {
    const std::uint64_t dice = random();
    std::string text(1, static_cast<char>(dice >> 8));
    if (dice % 64 != 0) text = words[(dice >> 16) % words.size()];
    for (const char c : text) {
      const auto byte = static_cast<std::uint8_t>(c);
      device.receive({&byte, 1}, now_ns += kByte_ns);
      ++sent;
    }
    if (dice % 2000 == 1) device.power_cycle(now_ns);
    if (turn % 100 != 0) continue;
    answered += device.answers(now_ns).size();
    for (std::size_t channel = 0; channel < device.channel_count(); ++channel) {
      const double pulse_us = device.pulse_us(channel, now_ns);
      pulses += pulse_us > 0.0;
      ASSERT_TRUE(pulse_us == 0.0 || (pulse_us >= min_us && pulse_us <= max_us))
          << pulse_us << " at " << sent;
      ASSERT_GE(device.shaft_us(channel, now_ns), min_us);
      ASSERT_LE(device.shaft_us(channel, now_ns), max_us);
    }
  }
  // Or the shower never got through to a command.
  EXPECT_GT(answered, 100u);
  EXPECT_GT(pulses, 100u);
}

const Words kSsc32Words{"#",     "#5",   "#31P2500", "P",    "P1500", "P2499", "S",        "S100", "T",
                        "T1000", "Q",    "QP5",      "VER",  "#1H",   "#2L",   "#3:",      "A",    "BL",
                        "VA",    "STOP", "PO",       "-100", "17",    "99999", "\xFF\x03", "\x80", "\x1B",
                        " ",     "\r",   "\r",       "\r",   "\r",    "\r"};

TEST(RandomInput, Ssc32U) {
  Ssc32Device device({});
  shower(device, kSsc32Words, 400.0, 2600.0);
  EXPECT_GT(device.bad_input_count(), 0u);
}

TEST(RandomInput, Ssc32) {
  Ssc32Device device(older());
  shower(device, kSsc32Words, 400.0, 2600.0);
}

const Words kMaestroWords{"\x84",
                          "\x87",
                          "\x89",
                          "\x90",
                          "\x93",
                          "\x9F",
                          "\xA1",
                          "\xA2",
                          "\xAA",
                          "\xFF",
                          "\x0C",
                          "\x04",
                          "\x10",
                          "\x21",
                          std::string(1, '\0'),
                          "\x01",
                          "\x02",
                          "\x70",
                          "\x2E",
                          "\x84\x02\x70\x2E",
                          "\x84\x02\x70\x20",
                          "\xAA\x0C\x07\x02\x01\x01"};

TEST(RandomInput, Maestro) {
  MaestroOptions options;
  options.errors_go_home = false;  // nothing would ever move
  MaestroDevice device(options);
  shower(device, kMaestroWords, 64.0, 4080.0);
}

TEST(RandomInput, MaestroWithCrc) {
  MaestroOptions options;
  options.crc = true;
  options.errors_go_home = false;
  MaestroDevice device(options);
  Words words = kMaestroWords;
  words.insert(words.end(), {"\xA1\x1B", "\xA1\x1B", "\xFF\x03\x10"});
  shower(device, words, 64.0, 4080.0);
}

}  // namespace
}  // namespace corbot::sim::random_input_test
