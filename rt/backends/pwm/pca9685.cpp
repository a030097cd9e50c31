// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/pwm/pca9685.h"

#include <time.h>

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

constexpr std::uint8_t kMode1 = 0x00;
constexpr std::uint8_t kMode2 = 0x01;
constexpr std::uint8_t kFirstLed = 0x06;
constexpr std::uint8_t kPreScale = 0xFE;
constexpr unsigned kBytesPerLed = 4;

constexpr std::uint8_t kRestart = 0x80;
constexpr std::uint8_t kAutoIncrement = 0x20;
constexpr std::uint8_t kSleep = 0x10;
constexpr std::uint8_t kModeMask = 0x7F;  // RESTART reads as a state and is written as a command
constexpr std::uint8_t kOutputsDriven = 0x04;
constexpr std::uint8_t kFull = 0x10;  // in ON_H: on for good; in OFF_H: off for good, and wins

constexpr long kOscillatorStart_ns = 500'000;
constexpr int kOffAttempts = 3;
constexpr int kPrescaleMin = 3;
constexpr int kPrescaleMax = 255;

std::uint8_t first_register_of(std::uint32_t channel) {
  return static_cast<std::uint8_t>(kFirstLed + kBytesPerLed * channel);
}

/// Returns the four registers of one output: on at 0, off at `counts`.
std::array<std::uint8_t, kBytesPerLed> registers_of(int counts) {
  if (counts <= 0) return {0, 0, 0, kFull};
  return {0, 0, static_cast<std::uint8_t>(counts & 0xFF), static_cast<std::uint8_t>(counts >> 8)};
}

/// Returns a number with two digits after the point.
std::string fixed(double value) {
  const auto hundredths = std::llround(value * 100.0);
  const auto rest = hundredths % 100;
  return std::to_string(hundredths / 100) + (rest < 10 ? ".0" : ".") + std::to_string(rest);
}

}  // namespace

int Pca9685::prescale_for(double oscillator_hz, double frame_hz) noexcept {
  const double exact = std::round(oscillator_hz / (kCounts * frame_hz)) - 1.0;
  return static_cast<int>(std::clamp(exact, double{kPrescaleMin}, double{kPrescaleMax}));
}

double Pca9685::count_us(double oscillator_hz, int prescale) noexcept {
  return (prescale + 1) / oscillator_hz * 1e6;
}

int Pca9685::counts_of(double pulse_us, double count_us) noexcept {
  if (!(pulse_us > 0.0)) return 0;
  return static_cast<int>(std::clamp(std::round(pulse_us / count_us), 1.0, kCounts - 1.0));
}

DeviceError Pca9685::missed(const DeviceError& error) const {
  const bool may_be_noise = is_open_ && error.cause() == DeviceCause::kNotThere;
  return {may_be_noise ? DeviceCause::kNoAnswer : error.cause(), error.what()};
}

void Pca9685::read_block(std::uint8_t first, std::span<std::uint8_t> into) {
  try {
    bus_->read(first, into);
  } catch (const DeviceError& error) {
    throw missed(error);
  }
}

void Pca9685::write_block(std::uint8_t first, std::span<const std::uint8_t> bytes) {
  try {
    bus_->write(first, bytes);
  } catch (const DeviceError& error) {
    throw missed(error);
  }
}

std::uint8_t Pca9685::read(std::uint8_t number) {
  std::uint8_t value = 0;
  read_block(number, {&value, 1});
  return value;
}

void Pca9685::write(std::uint8_t number, std::uint8_t value) { write_block(number, {&value, 1}); }

void Pca9685::close() noexcept {
  is_open_ = false;
  bus_->close();
}

std::string Pca9685::open() {
  is_open_ = false;
  bus_->open();
  const std::uint8_t mode = read(kMode1);
  const int found = read(kPreScale);
  if (found < kPrescaleMin) {
    throw DeviceError(DeviceCause::kBadAnswer,
                      bus_->name() + ": the device is not a PCA9685 (whose prescaler is never below 3)");
  }
  const int wanted = prescale_for(settings_.oscillator_hz, settings_.frame_hz);
  const bool is_new = (mode & kSleep) != 0;  // after power-up it sleeps
  write(kMode1, static_cast<std::uint8_t>((mode & kModeMask) | kAutoIncrement));
  write(kMode2, kOutputsDriven);
  count_us_ = count_us(settings_.oscillator_hz, wanted);
  period_ns_ = static_cast<std::int64_t>(count_us_ * kCounts * 1e3);
  if (found != wanted) set_prescale(mode, found, wanted);
  wake(read(kMode1));
  const int is_now = read(kPreScale);
  if (is_now != wanted || (read(kMode1) & kSleep) != 0) {
    throw DeviceError(DeviceCause::kBadAnswer,
                      bus_->name() + ": does not keep what is written: a prescaler of " +
                          std::to_string(wanted) + " reads back as " + std::to_string(is_now));
  }
  is_open_ = true;
  std::string text = "PCA9685 on " + bus_->name() + ": " + fixed(1e6 / (count_us_ * kCounts)) +
                     " frames a second, " + fixed(count_us_) + " us a count";
  if (!is_new && found != wanted) {
    text += "; it ran at " + fixed(1e6 / (count_us(settings_.oscillator_hz, found) * kCounts)) +
            " before: does another program use it?";
  }
  return text;
}

void Pca9685::set_prescale(std::uint8_t mode, int from, int to) {
  std::array<std::optional<int>, kChannels> sent{};
  for (std::uint32_t i = 0; i < kChannels; ++i) sent[i] = counts_at(i);
  write(kMode1, static_cast<std::uint8_t>((mode & kModeMask) | kAutoIncrement | kSleep));
  write(kPreScale, static_cast<std::uint8_t>(to));
  const double ratio = (from + 1.0) / (to + 1.0);
  for (std::uint32_t i = 0; i < kChannels; ++i) {
    if (sent[i]) write_counts(i, counts_of(*sent[i] * ratio, 1.0));
  }
}

void Pca9685::wake(std::uint8_t mode) {
  const auto awake =
      static_cast<std::uint8_t>(((mode & kModeMask) | kAutoIncrement) & ~static_cast<unsigned>(kSleep));
  write(kMode1, awake);
  const timespec start{0, kOscillatorStart_ns};
  (void)::nanosleep(&start, nullptr);
  // Outputs that were on when it went to sleep go on as they were.
  if ((read(kMode1) & kRestart) != 0) write(kMode1, static_cast<std::uint8_t>(awake | kRestart));
}

bool Pca9685::send(const ServoFrame& frame, bool) {
  // A chip whose power failed has lost its registers, and sleeps.
  if ((read(kMode1) & (kSleep | kAutoIncrement)) != kAutoIncrement) {
    throw DeviceError(DeviceCause::kDeviceFault,
                      bus_->name() + ": was reset: did its supply fail, or does another program use it?");
  }
  last_ = frame;
  const std::size_t count = std::min<std::size_t>(frame.servo_count, kMaxServos);
  std::array<std::uint8_t, I2cBus::kLongestBlock> block{};
  static_assert(kMaxServos * kBytesPerLed <= I2cBus::kLongestBlock);
  for (std::size_t i = 0; i < count;) {
    // Writes as many channels as follow each other in one block.
    const std::size_t first = i;
    do {
      const auto registers = registers_of(counts_of(frame.pulse_us[i], count_us_));
      std::copy(registers.begin(), registers.end(),
                block.begin() + static_cast<std::ptrdiff_t>((i - first) * kBytesPerLed));
      ++i;
    } while (i < count && frame.channel[i] == frame.channel[i - 1] + 1);
    write_block(first_register_of(frame.channel[first]), std::span(block).first((i - first) * kBytesPerLed));
  }
  return true;
}

std::optional<int> Pca9685::counts_at(std::uint32_t channel) {
  std::array<std::uint8_t, kBytesPerLed> registers{};
  read_block(first_register_of(channel), registers);
  if (((registers[1] | registers[3]) & kFull) != 0) return std::nullopt;
  const int on = registers[0] | (registers[1] & 0x0F) << 8;
  const int off = registers[2] | (registers[3] & 0x0F) << 8;
  const int counts = (off - on + kCounts) % kCounts;
  return counts > 0 ? std::optional(counts) : std::nullopt;
}

void Pca9685::write_counts(std::uint32_t channel, int counts) {
  const auto registers = registers_of(counts);
  write_block(first_register_of(channel), registers);
}

BusReading Pca9685::measure(const ServoFrame& frame) {
  BusReading reading{BusReading::Unit::kPulses, {}};
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    reading.value[i] = counts_at(frame.channel[i]).value_or(0) * count_us_;
  }
  return reading;
}

/// Tries every servo: a failed write to one must not keep the others energised.
void Pca9685::relax() {
  std::optional<DeviceError> failure;
  for (std::size_t i = 0; i < std::min<std::size_t>(last_.servo_count, kMaxServos); ++i) {
    for (int attempt = 1; attempt <= kOffAttempts; ++attempt) {
      try {
        write_counts(last_.channel[i], 0);
        break;
      } catch (const DeviceError& error) {
        if (attempt == kOffAttempts) failure = error;
      }
    }
  }
  if (failure) throw DeviceError(*failure);
}

}  // namespace corbot::rt
