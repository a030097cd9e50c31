// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/ssc32.h"

#include <algorithm>
#include <cmath>

#include "rt/backends/bus/approach_speed.h"

namespace corbot::rt {
namespace {

constexpr int kPulseMin_us = 500;
constexpr int kPulseMax_us = 2500;
constexpr int kApproach_ms = 2000;  // at least
constexpr double kApproach_us_per_ms = kApproach_us_per_s / 1000.0;
constexpr std::int64_t kServoFrame_ns = 20'000'000;
constexpr const char* kModelU = "SSC-32U";
constexpr std::size_t kLongestVersion = 64;
constexpr std::size_t kBitsPerByte = 10;  // 8N1
/// A short press is reported for this many frames, longer than any period of the cycle.
constexpr int kPressLasts_frames = 5;
/// QP of a channel that has had no pulse since power-up: the 500 us that the controller assumes for every
/// servo, or nothing.
constexpr double kNeverCommanded_us = 500.0;
/// One whose last pulse was at least this long does not pass there.
constexpr double kSurelyCommanded_us = 600.0;
constexpr double kUnitOfQp_us = 10.0;

bool is_never_commanded(std::uint8_t reply) {
  return reply == 0 || reply * kUnitOfQp_us == kNeverCommanded_us;
}

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
  constexpr std::size_t kBytesPerQuery = 5;  // QP31 and the reply; one of them, and CR, in every frame
  constexpr std::size_t kBytesPerInput = 4;  // AL, CR and the reply
  constexpr std::int64_t kReply_ns = 5'000'000;
  const std::size_t bytes = servos * kBytesPerServo + kBytesPerGroup + kBytesPerQuery + 1 +
                            (readback ? servos * kBytesPerQuery + 1 : 0) + (stop_input ? kBytesPerInput : 0);
  const std::int64_t replies_ns = (readback ? kReply_ns : 0) + (stop_input ? kReply_ns : 0);
  const auto line_ns =
      static_cast<std::int64_t>(bytes * kBitsPerByte * 1'000'000'000ull / static_cast<unsigned>(baud));
  // A tenth more, so that a controller that is a little slow does not fall behind for ever.
  const std::int64_t period_ns = line_ns + line_ns / 10 + replies_ns;
  // Where frames have a time, the reply to the first query is waited for.
  return period_ns <= kServoFrame_ns ? kServoFrame_ns : period_ns + kReply_ns;
}

std::string Ssc32::open() {
  dialog_.open(settings_.port, settings_.baud);
  reply_pending_ = is_served_ = false;
  // Drops a command that was cut off when a plug was pulled; a CR would execute it.
  dialog_.write("\x1b");
  dialog_.discard_input();
  const std::string model = query_version();
  is_u_ = model.starts_with(kModelU);
  period_ns_ =
      shortest_period_ns(settings_.servos, settings_.baud, settings_.readback, settings_.stop_input != 0);
  frames_pressed_ = 0;
  if (settings_.stop_input != 0) (void)query_stop_input();  // what it has latched before does not count
  dialog_.begin_service();
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return model + " on " + settings_.port + " at " + std::to_string(settings_.baud) +
         " baud: " + std::to_string(tenths_hz / 10) + "." + std::to_string(tenths_hz % 10) +
         " frames a second" +
         (period_ns_ > kServoFrame_ns ? ", all that the line carries; the servos could take 50" : "");
}

std::string Ssc32::query_version() {
  for (int attempt = 1;; ++attempt) {
    try {
      dialog_.write("VER\r");
      std::string model = model_of(read_line());
      if (!model.empty()) return model;
      throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": the device is not an SSC-32");
    } catch (const DeviceError& error) {
      if (attempt == 2 || !is_noise(error.cause())) throw;
      dialog_.discard_input();
    }
  }
}

std::int64_t Ssc32::approach_ns() const noexcept { return (approach_ms_ + 100) * 1'000'000ll; }

void Ssc32::send(const ServoFrame& frame, bool approach) {
  if (approach) {
    approach_to(frame);
  } else if (period_ns_ > kServoFrame_ns) {
    // Between frames that are far apart the controller interpolates. One that has restarted must not get a
    // time, see below; so it is queried first, and one that does not reply gets none either.
    query_one();
    const std::optional<DeviceError> missing = take_reply();
    dialog_.write(group(frame, missing ? 0 : static_cast<int>(period_ns_ / 1'000'000)));
    last_ = given_ = frame;
    if (missing) dialog_.note_miss(*missing);
  } else {
    // Queried before the frame, as afterwards it cannot be seen whether it was the first.
    query_one(group(frame, 0));
    last_ = given_ = frame;
    // The reply comes with that to the next query, where there is one.
    if (!settings_.readback && settings_.stop_input == 0) {
      if (const auto missing = take_reply()) dialog_.note_miss(*missing);
    }
  }
}

void Ssc32::approach_to(const ServoFrame& frame) {
  reply_pending_ = is_served_ = false;
  last_ = frame;
  // A servo that has had no pulse since power-up must get a plain one: with a time, an SSC-32 assumes that
  // it begins at 500 us, and throws the arm there first.
  const SerialDialog::Pulses pulse_us = stable_pulses(frame);
  ServoFrame plain = frame;
  ServoFrame slow = frame;
  plain.servo_count = 0;
  slow.servo_count = 0;
  double travel_us = 0.0;
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    const bool is_first = pulse_us[i] <= kNeverCommanded_us;
    double from_us = pulse_us[i];
    if (is_first) {
      // After a restart it is still about where it was sent last; else it may be anywhere.
      const bool was_given = i < given_.servo_count;
      from_us = was_given ? given_.pulse_us[i] : frame.pulse_us[i];
      if (was_given && log_.empty()) {
        log_ = settings_.port + ": has restarted: channel " + std::to_string(frame.channel[i]) +
               " has no pulse; it begins where it was sent last";
      }
      plain.channel[plain.servo_count] = frame.channel[i];
      plain.pulse_us[plain.servo_count++] = from_us;
      if (rounded(from_us) == rounded(frame.pulse_us[i])) continue;
    }
    slow.channel[slow.servo_count] = frame.channel[i];
    slow.pulse_us[slow.servo_count++] = frame.pulse_us[i];
    travel_us = std::max(travel_us, std::abs(rounded(frame.pulse_us[i]) - from_us));
  }
  approach_ms_ = std::max(kApproach_ms, static_cast<int>(std::ceil(travel_us / kApproach_us_per_ms)));
  if (plain.servo_count > 0) dialog_.write(group(plain, 0));
  if (slow.servo_count > 0) dialog_.write(group(slow, approach_ms_));
}

void Ssc32::halt() {
  if (is_u_) {
    std::string text;
    for (std::size_t i = 0; i < last_.servo_count; ++i) {
      text += "STOP" + std::to_string(last_.channel[i]) + "\r";
    }
    dialog_.write(text);
    return;
  }
  // An SSC-32 has no STOP: a plain move to where it is, to 10 us; but none to 500 us, where nothing is.
  const SerialDialog::Pulses pulse_us = stable_pulses(last_);
  ServoFrame here = last_;
  here.servo_count = 0;
  for (std::size_t i = 0; i < last_.servo_count; ++i) {
    if (pulse_us[i] <= kNeverCommanded_us) continue;
    here.channel[here.servo_count] = last_.channel[i];
    here.pulse_us[here.servo_count++] = pulse_us[i];
  }
  if (here.servo_count > 0) dialog_.write(group(here, 0));
}

BusReading Ssc32::measure(const ServoFrame& frame) {
  if (!is_served_) return {BusReading::Unit::kPulses, stable_pulses(frame)};
  try {
    const BusReading reading{BusReading::Unit::kPulses, query(frame)};
    dialog_.note_reply();
    return reading;
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
  }
  return {};
}

bool Ssc32::emergency_stop() {
  if (settings_.stop_input == 0) return false;
  try {
    if (query_stop_input()) frames_pressed_ = kPressLasts_frames;
    dialog_.note_reply();
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
  }
  return frames_pressed_ > 0 && frames_pressed_-- > 0;
}

bool Ssc32::query_stop_input() {
  std::uint8_t level = 0;
  // The controller latches a low level, not a high one.
  query(std::string(1, settings_.stop_input) + (settings_.stop_at_high ? "\r" : "L\r"), {&level, 1});
  if (level != '0' && level != '1') {
    throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": input " + settings_.stop_input +
                                                   " is neither 0 nor 1: is the line disturbed?");
  }
  return (level == '1') == settings_.stop_at_high;
}

SerialDialog::Pulses Ssc32::stable_pulses(const ServoFrame& frame) {
  return dialog_.read_until_stable(frame.servo_count, [&] { return query(frame); });
}

SerialDialog::Pulses Ssc32::query(const ServoFrame& frame) {
  std::string text;
  for (std::size_t i = 0; i < frame.servo_count; ++i) text += "QP" + std::to_string(frame.channel[i]);
  std::array<std::uint8_t, kMaxServos> reply{};
  query(text + "\r", std::span(reply).first(frame.servo_count));
  SerialDialog::Pulses pulse_us{};
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    if (is_served_) check_restart(i, reply[i]);
    pulse_us[i] = kUnitOfQp_us * reply[i];
  }
  return pulse_us;
}

void Ssc32::query(std::string_view text, std::span<std::uint8_t> reply) {
  if (!reply_pending_) dialog_.discard_input();
  dialog_.write(text);
  if (reply_pending_) {
    if (const auto missing = take_reply()) throw DeviceError(*missing);
  }
  dialog_.read(reply);
}

void Ssc32::query_one(std::string_view more) {
  dialog_.discard_input();
  queried_ = 0;
  for (std::size_t i = 1; i < last_.servo_count; ++i) {
    if (last_.pulse_us[i] > last_.pulse_us[queried_]) queried_ = i;
  }
  is_served_ = reply_pending_ = true;
  dialog_.write("QP" + std::to_string(last_.channel[queried_]) + "\r" + std::string(more));
}

std::optional<DeviceError> Ssc32::take_reply() {
  reply_pending_ = false;
  std::uint8_t reply = 0;
  try {
    dialog_.read({&reply, 1});
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    return error;
  }
  check_restart(queried_, reply);
  dialog_.note_reply();
  return std::nullopt;
}

void Ssc32::check_restart(std::size_t servo, std::uint8_t reply) const {
  if (last_.servo_count == 0 || last_.pulse_us[servo] < kSurelyCommanded_us || !is_never_commanded(reply))
    return;
  throw DeviceError(DeviceCause::kDeviceFault, settings_.port + ": has restarted: it has given channel " +
                                                   std::to_string(last_.channel[servo]) +
                                                   " no pulse, though it was commanded to");
}

void Ssc32::relax() {
  std::string text;
  for (std::size_t i = 0; i < last_.servo_count; ++i) text += "#" + std::to_string(last_.channel[i]) + "L";
  dialog_.write(text + "\r");
}

std::string Ssc32::read_line() {
  std::string line;
  while (line.size() < kLongestVersion) {
    std::uint8_t byte = 0;
    dialog_.read({&byte, 1});
    if (byte == '\r') return line;
    line += static_cast<char>(byte);
  }
  return line;
}

}  // namespace corbot::rt
