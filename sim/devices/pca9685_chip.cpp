// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/pca9685_chip.h"

namespace corbot::sim {
namespace {

constexpr std::uint8_t kMode1 = 0x00;
constexpr std::uint8_t kFirstLed = 0x06;
constexpr std::uint8_t kLastLed = 0x45;
constexpr std::uint8_t kAllLed = 0xFA;
constexpr std::uint8_t kPreScale = 0xFE;
constexpr std::uint8_t kRestart = 0x80;
constexpr std::uint8_t kAutoIncrement = 0x20;
constexpr std::uint8_t kSleep = 0x10;
constexpr std::uint8_t kFull = 0x10;
constexpr int kCounts = 4096;

bool is_led(std::uint8_t number) { return number >= kFirstLed && number <= kLastLed; }

/// Returns the address after `number`: it wraps from the last LED register to the first, as in the data
/// sheet.
std::uint8_t after(std::uint8_t number) {
  return number == kLastLed ? kMode1 : static_cast<std::uint8_t>(number + 1);
}

}  // namespace

void Pca9685Chip::power_cycle() {
  registers_.fill(0);
  registers_[kMode1] = kSleep | 0x01;
  registers_[0x01] = 0x04;
  registers_[kPreScale] = 0x1E;
  for (std::size_t i = 0; i < kOutputs; ++i) registers_[kFirstLed + 4 * i + 3] = kFull;
  is_halted_ = false;
}

bool Pca9685Chip::write(std::uint8_t first, std::span<const std::uint8_t> bytes) {
  if (refused_ > 0) {
    --refused_;
    return false;
  }
  if (is_led(first) || (first >= kAllLed && first < kPreScale)) ++led_writes_;
  const bool advances = (registers_[kMode1] & kAutoIncrement) != 0;
  for (const std::uint8_t byte : bytes) {
    store(first, byte);
    if (advances) first = after(first);
  }
  return true;
}

bool Pca9685Chip::read(std::uint8_t first, std::span<std::uint8_t> into) {
  if (refused_ > 0) {
    --refused_;
    return false;
  }
  const bool advances = (registers_[kMode1] & kAutoIncrement) != 0;
  for (std::uint8_t& byte : into) {
    byte = registers_[first];
    if (advances) first = after(first);
  }
  return true;
}

void Pca9685Chip::store(std::uint8_t number, std::uint8_t value) {
  if (number == kMode1) {
    store_mode1(value);
  } else if (number == kPreScale) {
    if ((registers_[kMode1] & kSleep) != 0) registers_[kPreScale] = value < 3 ? 3 : value;
  } else if (number >= kAllLed && number < kPreScale) {
    for (std::size_t i = 0; i < kOutputs; ++i) registers_[kFirstLed + 4 * i + (number - kAllLed)] = value;
    is_halted_ = false;
  } else {
    registers_[number] = value;
    if (is_led(number)) {
      is_halted_ = false;
      registers_[kMode1] &= static_cast<std::uint8_t>(~kRestart);
    }
  }
}

void Pca9685Chip::store_mode1(std::uint8_t value) {
  const bool was_asleep = (registers_[kMode1] & kSleep) != 0;
  const bool sleeps = (value & kSleep) != 0;
  bool restart = (registers_[kMode1] & kRestart) != 0;
  if (!was_asleep && sleeps) {
    for (std::size_t i = 0; i < kOutputs; ++i) restart |= high_counts(i) > 0;
  }
  if (was_asleep && !sleeps) is_halted_ = restart;
  if (!was_asleep && !sleeps && (value & kRestart) != 0) {  // written as 1 it is cleared, and all goes on
    restart = false;
    is_halted_ = false;
  }
  registers_[kMode1] = static_cast<std::uint8_t>((value & ~kRestart) | (restart ? kRestart : 0));
}

int Pca9685Chip::high_counts(std::size_t output) const {
  if ((registers_[kMode1] & kSleep) != 0 || is_halted_) return 0;
  const std::uint8_t* led = &registers_[kFirstLed + 4 * output];
  if ((led[3] & kFull) != 0) return 0;
  if ((led[1] & kFull) != 0) return kCounts;
  const int on = led[0] | (led[1] & 0x0F) << 8;
  const int off = led[2] | (led[3] & 0x0F) << 8;
  return (off - on + kCounts) % kCounts;
}

}  // namespace corbot::sim
