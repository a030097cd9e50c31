// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/ssc32.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = SerialPort::Clock;

constexpr int kPulseMin_us = 500;
constexpr int kPulseMax_us = 2500;
constexpr int kApproach_ms = 2000;
constexpr std::int64_t kServoFrame_ns = 20'000'000;
constexpr const char* kModelU = "SSC-32U";
constexpr std::size_t kLongestVersion = 64;
constexpr std::size_t kBitsPerByte = 10;  // 8N1
constexpr auto kAnswerWithin = 300ms;
/// A short press is told for this many frames, longer than any period of the cycle.
constexpr int kPressLasts_frames = 5;
/// What QP tells of a channel that has had no pulse since power-up: the 500 us at which the controller
/// believes every servo, or nothing.
constexpr double kNeverCommanded_us = 500.0;

int rounded(double pulse_us) {
  return static_cast<int>(std::lround(std::clamp(pulse_us, double{kPulseMin_us}, double{kPulseMax_us})));
}

}  // namespace

std::string Ssc32::group(const ServoFrame& frame, int time_ms) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    text += "#" + std::to_string(frame.channel[i]) + "P" + std::to_string(rounded(frame.pulse_us[i]));
  }
  if (time_ms > 0) text += "T" + std::to_string(time_ms);
  return text + "\r";
}

std::string Ssc32::model_of(std::string_view version) {
  if (!version.starts_with("SSC32")) return {};
  const std::string_view rest = version.substr(0, kLongestVersion);
  if (!std::all_of(rest.begin(), rest.end(), [](char c) { return c >= 0x20 && c < 0x7f; })) return {};
  const bool is_u = rest.find("USB") != std::string_view::npos;
  return std::string(is_u ? kModelU : "SSC-32") + " (" + std::string(rest) + ")";
}

std::int64_t Ssc32::shortest_period_ns(std::size_t servos, int baud, bool readback,
                                       bool stop_input) noexcept {
  constexpr std::size_t kBytesPerServo = 8;  // #31P2500
  constexpr std::size_t kBytesPerGroup = 7;  // T65535 and CR
  constexpr std::size_t kBytesPerQuery = 5;  // QP31 and the answer
  constexpr std::size_t kBytesPerInput = 4;  // AL, CR and the answer
  constexpr std::int64_t kAnswer_ns = 5'000'000;
  const std::size_t bytes = servos * kBytesPerServo + kBytesPerGroup +
                            (readback ? servos * kBytesPerQuery + 1 : 0) + (stop_input ? kBytesPerInput : 0);
  const std::int64_t answers_ns = (readback ? kAnswer_ns : 0) + (stop_input ? kAnswer_ns : 0);
  const auto line_ns =
      static_cast<std::int64_t>(bytes * kBitsPerByte * 1'000'000'000ull / static_cast<unsigned>(baud));
  // A tenth more, so that a controller that is a little slow does not fall behind for ever.
  return std::max(kServoFrame_ns, line_ns + line_ns / 10 + answers_ns);
}

std::string Ssc32::open() {
  port_.open(settings_.port, settings_.baud);
  write("\r");  // ends whatever an earlier program left half said
  port_.discard_input();
  write("VER\r");
  const std::string model = model_of(read_line());
  if (model.empty())
    throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": answers, but is no SSC-32");
  is_u_ = model.starts_with(kModelU);
  period_ns_ =
      shortest_period_ns(settings_.servos, settings_.baud, settings_.readback, settings_.stop_input != 0);
  frames_pressed_ = 0;
  if (settings_.stop_input != 0) (void)ask_stop_input();  // what it has latched before does not count
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return model + " on " + settings_.port + " at " + std::to_string(settings_.baud) +
         " baud: " + std::to_string(tenths_hz / 10) + "." + std::to_string(tenths_hz % 10) +
         " frames a second" +
         (period_ns_ > kServoFrame_ns ? ", all that the line carries; the servos could take 50" : "");
}

std::int64_t Ssc32::approach_ns() const noexcept { return (kApproach_ms + 100) * 1'000'000ll; }

void Ssc32::send(const ServoFrame& frame, bool approach) {
  last_ = frame;
  if (!approach) {
    // Between frames that are far apart the controller interpolates.
    write(group(frame, period_ns_ > kServoFrame_ns ? static_cast<int>(period_ns_ / 1'000'000) : 0));
    return;
  }
  // A servo that has had no pulse since power-up must get a plain one: with a time, an SSC-32 believes that
  // it begins at 500 us, and throws the arm there first.
  std::array<double, kMaxServos> pulse_us{};
  query(frame, pulse_us);
  ServoFrame plain = frame;
  ServoFrame slow = frame;
  plain.servo_count = 0;
  slow.servo_count = 0;
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    ServoFrame& to = pulse_us[i] <= kNeverCommanded_us ? plain : slow;
    to.channel[to.servo_count] = frame.channel[i];
    to.pulse_us[to.servo_count++] = frame.pulse_us[i];
  }
  if (plain.servo_count > 0) write(group(plain, 0));
  if (slow.servo_count > 0) write(group(slow, kApproach_ms));
}

void Ssc32::halt() {
  if (is_u_) {
    std::string text;
    for (std::size_t i = 0; i < last_.servo_count; ++i) {
      text += "STOP" + std::to_string(last_.channel[i]) + "\r";
    }
    write(text);
    return;
  }
  // An SSC-32 knows no STOP: a plain move to where it is, to 10 us.
  ServoFrame here = last_;
  query(here, here.pulse_us);
  write(group(here, 0));
}

BusReading Ssc32::measure(const ServoFrame& frame) {
  BusReading reading{BusReading::Unit::kPulses, {}};
  query(frame, reading.value);
  return reading;
}

bool Ssc32::emergency_stop() {
  if (settings_.stop_input == 0) return false;
  if (ask_stop_input()) frames_pressed_ = kPressLasts_frames;
  return frames_pressed_ > 0 && frames_pressed_-- > 0;
}

bool Ssc32::ask_stop_input() {
  port_.discard_input();
  // The controller latches a low level, not a high one.
  write(std::string(1, settings_.stop_input) + (settings_.stop_at_high ? "\r" : "L\r"));
  std::uint8_t level = 0;
  port_.read_exactly({&level, 1}, Clock::now() + kAnswerWithin);
  if (level != '0' && level != '1') {
    throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": input " + settings_.stop_input +
                                                   " is neither 0 nor 1: is the line disturbed?");
  }
  return (level == '1') == settings_.stop_at_high;
}

void Ssc32::query(const ServoFrame& frame, std::array<double, kMaxServos>& pulse_us) {
  constexpr double kUnit_us = 10.0;
  port_.discard_input();
  std::string text;
  for (std::size_t i = 0; i < frame.servo_count; ++i) text += "QP" + std::to_string(frame.channel[i]);
  write(text + "\r");
  std::array<std::uint8_t, kMaxServos> answer{};
  port_.read_exactly(std::span(answer).first(frame.servo_count), Clock::now() + kAnswerWithin);
  for (std::size_t i = 0; i < frame.servo_count; ++i) pulse_us[i] = kUnit_us * answer[i];
}

void Ssc32::relax() {
  std::string text;
  for (std::size_t i = 0; i < last_.servo_count; ++i) text += "#" + std::to_string(last_.channel[i]) + "L";
  write(text + "\r");
}

void Ssc32::write(std::string_view text) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  port_.write({bytes, text.size()}, Clock::now() + kAnswerWithin + std::chrono::nanoseconds(period_ns_));
}

std::string Ssc32::read_line() {
  std::string line;
  const auto deadline = Clock::now() + kAnswerWithin;
  while (line.size() < kLongestVersion) {
    std::uint8_t byte = 0;
    port_.read_exactly({&byte, 1}, deadline);
    if (byte == '\r') return line;
    line += static_cast<char>(byte);
  }
  return line;
}

}  // namespace corbot::rt
