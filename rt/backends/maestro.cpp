// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/maestro.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = SerialPort::Clock;

constexpr std::uint8_t kSetTarget = 0x84;
constexpr std::uint8_t kSetSpeed = 0x87;
constexpr std::uint8_t kGetPosition = 0x90;
constexpr std::uint8_t kSetTargets = 0x9F;
constexpr std::uint8_t kGetErrors = 0xA1;
constexpr std::uint8_t kPololu = 0xAA;
constexpr unsigned kQuartersPerMicrosecond = 4;
/// In 0.25 us a 10 ms: 400 us/s, the whole range of a servo in five seconds.
constexpr unsigned kApproachSpeed = 16;
constexpr std::int64_t kServoFrame_ns = 20'000'000;
constexpr int kFramesPerCheck = 50;
constexpr auto kAnswerWithin = 300ms;

std::uint8_t low7(unsigned value) { return static_cast<std::uint8_t>(value & 0x7F); }
std::uint8_t high7(unsigned value) { return static_cast<std::uint8_t>((value >> 7) & 0x7F); }

unsigned target_of(double pulse_us) {
  return static_cast<unsigned>(std::lround(std::clamp(pulse_us, 0.0, 4000.0) * kQuartersPerMicrosecond));
}

}  // namespace

std::uint8_t Maestro::crc7(const Bytes& message) noexcept {
  constexpr unsigned kPolynomial = 0x91;
  unsigned crc = 0;
  for (const std::uint8_t byte : message) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      if ((crc & 1) != 0) crc ^= kPolynomial;
      crc >>= 1;
    }
  }
  return static_cast<std::uint8_t>(crc);
}

Maestro::Bytes Maestro::command(std::uint8_t number, const Bytes& data) const {
  Bytes bytes;
  if (settings_.device_number < 0) {
    bytes.push_back(number);
  } else {
    bytes = {kPololu, low7(static_cast<unsigned>(settings_.device_number)), low7(number)};
  }
  bytes.insert(bytes.end(), data.begin(), data.end());
  if (settings_.crc) bytes.push_back(crc7(bytes));
  return bytes;
}

Maestro::Bytes Maestro::targets(const ServoFrame& frame) const {
  const std::size_t count = std::min<std::size_t>(frame.servo_count, kMaxServos);
  bool in_a_row = count > 1;
  for (std::size_t i = 1; i < count; ++i) in_a_row = in_a_row && frame.channel[i] == frame.channel[0] + i;
  Bytes all;
  Bytes data;
  if (in_a_row) data = {static_cast<std::uint8_t>(count), low7(frame.channel[0])};
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned target = target_of(frame.pulse_us[i]);
    if (!in_a_row) data = {low7(frame.channel[i])};
    data.insert(data.end(), {low7(target), high7(target)});
    if (in_a_row) continue;
    const Bytes one = command(kSetTarget, data);
    all.insert(all.end(), one.begin(), one.end());
  }
  return in_a_row ? command(kSetTargets, data) : all;
}

std::string Maestro::errors_in_words(unsigned errors) {
  static constexpr std::array<const char*, 9> kNames{
      "serial signal", "serial overrun",    "serial buffer full",
      "serial CRC",    "serial protocol",   "serial timeout",
      "script stack",  "script call stack", "script program counter"};
  std::string words;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((errors >> i & 1u) != 0) words += (words.empty() ? "" : ", ") + std::string(kNames[i]);
  }
  return words;
}

std::string Maestro::open() {
  port_.open(settings_.port, settings_.baud);
  constexpr std::uint8_t kDetectBaud = 0xAA;
  write({kDetectBaud});
  port_.discard_input();
  (void)ask(kGetErrors, {});  // clears what an earlier program left, and shows that somebody answers
  is_slow_ = false;
  constexpr std::int64_t kBytesPerServo = 8;  // AA dev cmd ch lo hi crc, or the question for its position
  const auto bytes =
      static_cast<std::int64_t>(settings_.servos) * kBytesPerServo * (settings_.readback ? 2 : 1);
  period_ns_ = std::max(kServoFrame_ns, bytes * 11'000'000'000 / settings_.baud);
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return "Maestro on " + settings_.port + ": " + std::to_string(tenths_hz / 10) + "." +
         std::to_string(tenths_hz % 10) + " frames a second";
}

void Maestro::send(const ServoFrame& frame, bool approach) {
  last_ = frame;
  if (approach != is_slow_) {
    const unsigned speed = approach ? kApproachSpeed : 0;  // 0: no limit
    for (std::size_t i = 0; i < frame.servo_count; ++i) {
      write(command(kSetSpeed, {low7(frame.channel[i]), low7(speed), high7(speed)}));
    }
    is_slow_ = approach;
  }
  write(targets(frame));
  if (++frames_since_check_ >= kFramesPerCheck) check_errors();
}

void Maestro::halt() {
  ServoFrame here = last_;
  here.pulse_us = measure(last_).value;
  write(targets(here));
}

BusReading Maestro::measure(const ServoFrame& frame) {
  BusReading reading{BusReading::Unit::kPulses, {}};
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    reading.value[i] =
        static_cast<double>(ask(kGetPosition, {low7(frame.channel[i])})) / kQuartersPerMicrosecond;
  }
  return reading;
}

void Maestro::relax() {
  ServoFrame off = last_;
  off.pulse_us.fill(0.0);  // a target of 0: no pulses
  write(targets(off));
}

void Maestro::check_errors() {
  frames_since_check_ = 0;
  const unsigned errors = ask(kGetErrors, {});
  if (errors == 0) return;
  throw DeviceError(DeviceCause::kDeviceFault,
                    settings_.port + ": the Maestro reports " + errors_in_words(errors));
}

void Maestro::write(const Bytes& bytes) {
  port_.write(bytes, Clock::now() + kAnswerWithin + std::chrono::nanoseconds(period_ns_));
}

unsigned Maestro::ask(std::uint8_t number, const Bytes& data) {
  port_.discard_input();
  write(command(number, data));
  std::array<std::uint8_t, 2> answer{};
  port_.read_exactly(answer, Clock::now() + kAnswerWithin);
  return answer[0] | static_cast<unsigned>(answer[1]) << 8;
}

}  // namespace corbot::rt
