// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/maestro.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/backends/bus/approach_speed.h"
#include "rt/backends/serial/adapter_latency.h"

namespace corbot::rt {
namespace {

constexpr std::uint8_t kSetTarget = 0x84;
constexpr std::uint8_t kSetSpeed = 0x87;
constexpr std::uint8_t kSetAcceleration = 0x89;
constexpr std::uint8_t kGetPosition = 0x90;
constexpr std::uint8_t kSetTargets = 0x9F;
constexpr std::uint8_t kGetErrors = 0xA1;
constexpr std::uint8_t kPololu = 0xAA;  // alone: shows the baud to a board that is set to detect it
constexpr unsigned kQuartersPerMicrosecond = 4;
constexpr double kUnit_us = 1.0 / kQuartersPerMicrosecond;
/// The unit is 0.25 us per 10 ms.
constexpr auto kApproachSpeed = static_cast<unsigned>(kApproach_us_per_s * kQuartersPerMicrosecond / 100.0);
/// The value of 1 in the board's unit: 0.25 us per 10 ms and 80 ms.
constexpr double kAcceleration_us_per_s2 = 312.5;
constexpr double kMostAcceleration = 255.0;
constexpr int kFramesPerCheck = 50;
constexpr int kMostUnansweredChecks = 5;
constexpr double kShortestApproach_s = 2.5;
constexpr double kMostTravel_us = 2000.0;
constexpr unsigned kMostPosition = 0x3FFF;  // as a target
constexpr unsigned kAllErrors = 0x1FF;
constexpr unsigned kSerialTimeout = 1u << 5;
/// A servo on an approach changes its position by 8 us from one look to the next.
constexpr int kStuckAfter_looks = 3;

std::uint8_t low7(unsigned value) { return static_cast<std::uint8_t>(value & 0x7F); }
std::uint8_t high7(unsigned value) { return static_cast<std::uint8_t>((value >> 7) & 0x7F); }

void append(Maestro::Bytes& all, const Maestro::Bytes& more) {
  all.insert(all.end(), more.begin(), more.end());
}

unsigned acceleration_of(double us_per_s2) {
  return static_cast<unsigned>(std::clamp(us_per_s2 / kAcceleration_us_per_s2, 1.0, kMostAcceleration));
}

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

Maestro::Bytes Maestro::limits(const ServoFrame& frame, unsigned speed, unsigned acceleration) const {
  Bytes all;
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    const std::uint8_t channel = low7(frame.channel[i]);
    append(all, command(kSetSpeed, {channel, low7(speed), high7(speed)}));
    append(all, command(kSetAcceleration, {channel, low7(acceleration), high7(acceleration)}));
  }
  return all;
}

Maestro::Bytes Maestro::targets(const ServoFrame& frame) const {
  const std::size_t count = std::min<std::size_t>(frame.servo_count, kMaxServos);
  bool in_a_row = settings_.multi_target && count > 1;
  for (std::size_t i = 1; i < count; ++i) in_a_row = in_a_row && frame.channel[i] == frame.channel[0] + i;
  Bytes all;
  Bytes data;
  if (in_a_row) data = {static_cast<std::uint8_t>(count), low7(frame.channel[0])};
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned target = target_of(frame.pulse_us[i]);
    if (!in_a_row) data = {low7(frame.channel[i])};
    data.insert(data.end(), {low7(target), high7(target)});
    if (in_a_row) continue;
    append(all, command(kSetTarget, data));
  }
  return in_a_row ? command(kSetTargets, data) : all;
}

std::string Maestro::describe_errors(unsigned errors) {
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

unsigned Maestro::identify() {
  dialog_.open(settings_.port, settings_.baud);
  is_served_ = is_slow_ = is_on_the_way_ = false;
  frames_since_check_ = unanswered_checks_ = 0;
  found_errors_ = 0;
  approached_ = 0;
  if (settings_.detect_baud) dialog_.write(Bytes{kPololu});
  unsigned errors = 0;
  try {
    errors = query_errors();
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    errors = query_errors();
  }
  dialog_.begin_service();
  return errors;
}

std::string Maestro::open() {
  (void)identify();
  constexpr std::int64_t kBytesPerServo = 8;  // AA dev cmd ch lo hi crc, or the query for its position
  constexpr std::int64_t kBytesPerQuery = 7;  // AA dev cmd ch crc, and the reply
  const auto bytes =
      static_cast<std::int64_t>(settings_.servos) * kBytesPerServo * (settings_.readback ? 2 : 1) +
      kBytesPerQuery;
  period_ns_ = std::max(kServoFrame_ns, bytes * 11'000'000'000 / settings_.baud);
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return "Maestro on " + settings_.port + ": " + std::to_string(tenths_hz / 10) + "." +
         std::to_string(tenths_hz % 10) + " frames a second" + latency_warning(dialog_.latency_ms());
}

bool Maestro::send(const ServoFrame& frame, bool approach) {
  if (approach) {
    approach_to(frame);
    return true;
  }
  if (!is_still_there(frame)) return false;
  Bytes bytes;
  if (is_slow_) bytes = limits(frame, 0, 0);
  is_slow_ = is_on_the_way_ = false;
  append(bytes, targets(frame));
  dialog_.write(bytes);
  last_ = given_ = frame;
  is_served_ = true;
  approached_ = 0;
  if (++frames_since_check_ >= kFramesPerCheck) check_errors();
  return true;
}

/// Queries the frame's first servo, which is never commanded to 0. A servo whose power failed gets no target:
/// this would be a pulse at once, at full speed.
bool Maestro::is_still_there(const ServoFrame& frame) {
  try {
    send_query(command(kGetPosition, {low7(frame.channel[0])}));
    const unsigned position = read_position();
    check_restart(frame.channel[0], position);
    dialog_.note_reply();
    return true;
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
  }
  return false;
}

void Maestro::approach_to(const ServoFrame& frame) {
  is_served_ = false;
  looks_unchanged_ = 0;
  if (is_on_the_way_ && approached_ == frame.servo_count) return go_elsewhere(frame);
  is_on_the_way_ = false;
  if (last_.servo_count == 0) last_ = frame;  // for relax()
  clear_timeout();
  const SerialDialog::Pulses reported_us = stable_pulses(frame);
  double travel_us = 0.0;
  ServoFrame off = frame;
  off.servo_count = 0;
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    double from_us = reported_us[i];
    if (i < approached_)  // its pulses end by a loss of power alone, after which no limit holds
      check_restart(frame.channel[i], static_cast<unsigned>(std::lround(from_us * kQuartersPerMicrosecond)));
    if (from_us <= 0.0 && i < given_.servo_count) {
      // Without pulses, no limit holds for it; it is still about at its last target.
      from_us = given_.pulse_us[i];
      off.channel[off.servo_count] = frame.channel[i];
      off.pulse_us[off.servo_count++] = from_us;
    }
    // A servo that was never given a target may be anywhere, and moves as fast as it can.
    const double way_us = from_us > 0.0 ? std::abs(frame.pulse_us[i] - from_us) : 0.0;
    travel_us = std::max(travel_us, std::min(way_us, kMostTravel_us));
  }
  const unsigned acceleration = acceleration_of(settings_.approach_us_per_s2);
  const double ramps_s = kApproach_us_per_s / (acceleration * kAcceleration_us_per_s2);
  approach_ns_ = static_cast<std::int64_t>(
      1e9 * std::max(kShortestApproach_s, 0.1 + travel_us / kApproach_us_per_s + ramps_s));
  if (off.servo_count > 0) {
    log_ = settings_.port + ": has restarted: channel " + std::to_string(off.channel[0]) +
           " has no pulses, and begins at its last target";
    dialog_.write(targets(off));
  }
  dialog_.write(limits(frame, kApproachSpeed, acceleration));
  is_slow_ = true;
  check_errors();  // a limit garbled on its way is no limit
  dialog_.write(targets(frame));
  last_ = frame;
  approached_ = frame.servo_count;
  is_on_the_way_ = true;
}

/// The limits of the approach are in force. A missing reply must not keep a Stop from the servos.
void Maestro::go_elsewhere(const ServoFrame& frame) {
  (void)look();
  double further_us = 0.0;
  for (std::size_t i = 0; i < frame.servo_count; ++i)
    further_us =
        std::max(further_us, std::min(std::abs(frame.pulse_us[i] - last_.pulse_us[i]), kMostTravel_us));
  approach_ns_ += static_cast<std::int64_t>(1e9 * further_us / kApproach_us_per_s);
  dialog_.write(targets(frame));
  last_ = frame;
}

void Maestro::clear_timeout() {
  unsigned errors = 0;
  try {
    errors = query_errors();
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    errors = query_errors();
  }
  found_errors_ = errors & ~kSerialTimeout;  // the next check refuses them
  if ((errors & kSerialTimeout) != 0)
    log_ = settings_.port + ": the Maestro's own time-out passed before the first command";
}

/// Queries the pulses on an approach. Empty: a reply is missing or wrong. A board that has fallen silent is
/// detected as soon as it is served.
std::optional<SerialDialog::Pulses> Maestro::look() {
  try {
    const SerialDialog::Pulses now_us = query(last_);
    for (std::size_t i = 0; i < last_.servo_count; ++i)
      check_restart(last_.channel[i],
                    static_cast<unsigned>(std::lround(now_us[i] * kQuartersPerMicrosecond)));
    return now_us;
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    return std::nullopt;
  }
}

std::optional<bool> Maestro::has_arrived(BusReading& on_the_way) {
  const std::optional<SerialDialog::Pulses> seen_us = look();
  if (!seen_us) return std::nullopt;
  const SerialDialog::Pulses now_us = *seen_us;
  on_the_way = {BusReading::Unit::kPulses, now_us, {}, kUnit_us};
  const bool is_unchanged = std::exchange(polled_us_, now_us) == now_us;
  looks_unchanged_ = is_unchanged ? looks_unchanged_ + 1 : 0;
  for (std::size_t i = 0; i < last_.servo_count; ++i) {
    if (std::abs(now_us[i] - last_.pulse_us[i]) <= kUnit_us) continue;
    if (looks_unchanged_ < kStuckAfter_looks) return false;
    if (looks_unchanged_ == kStuckAfter_looks && log_.empty()) {
      log_ = settings_.port + ": channel " + std::to_string(last_.channel[i]) + " stops at " +
             std::to_string(std::lround(now_us[i])) + " us, short of " +
             std::to_string(std::lround(last_.pulse_us[i])) +
             " us: are its Min and Max as wide as the profile's range?";
    }
  }
  return true;
}

void Maestro::halt() {
  is_on_the_way_ = false;
  ServoFrame here = last_;
  here.pulse_us = stable_pulses(last_);  // 0 if it has no pulses, and then gets none
  // The servo loses its speed by its limit: a target behind the end of its braking would turn it back.
  const double braking_us = 0.5 * kApproach_us_per_s * kApproach_us_per_s /
                            (acceleration_of(settings_.approach_us_per_s2) * kAcceleration_us_per_s2);
  for (std::size_t i = 0; i < here.servo_count; ++i) {
    if (here.pulse_us[i] > 0.0)
      here.pulse_us[i] += std::clamp(last_.pulse_us[i] - here.pulse_us[i], -braking_us, braking_us);
  }
  dialog_.write(targets(here));
}

BusReading Maestro::measure(const ServoFrame& frame) {
  if (!is_served_) return {BusReading::Unit::kPulses, stable_pulses(frame), {}, kUnit_us};
  try {
    const BusReading reading{BusReading::Unit::kPulses, query(frame), {}, kUnit_us};
    dialog_.note_reply();
    return reading;
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
  }
  return {};
}

void Maestro::relax() {
  ServoFrame off = last_;
  off.pulse_us.fill(0.0);  // a target of 0: no pulses
  approached_ = 0;
  is_on_the_way_ = false;
  dialog_.write(targets(off));
}

SerialDialog::Pulses Maestro::stable_pulses(const ServoFrame& frame) {
  return dialog_.read_until_stable(frame.servo_count, [&] { return query(frame); });
}

SerialDialog::Pulses Maestro::query(const ServoFrame& frame) {
  Bytes queries;
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    append(queries, command(kGetPosition, {low7(frame.channel[i])}));
  }
  send_query(queries);
  SerialDialog::Pulses pulse_us{};
  for (std::size_t i = 0; i < frame.servo_count; ++i) {
    const unsigned position = read_position();
    if (is_served_) check_restart(frame.channel[i], position);
    pulse_us[i] = static_cast<double>(position) / kQuartersPerMicrosecond;
  }
  return pulse_us;
}

void Maestro::check_errors() {
  frames_since_check_ = 0;
  try {
    const unsigned errors = query_errors() | std::exchange(found_errors_, 0);
    unanswered_checks_ = 0;
    dialog_.note_reply();
    if (errors != 0) refuse(errors);
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
    if (++unanswered_checks_ < kMostUnansweredChecks) return;
    unanswered_checks_ = 0;
    throw DeviceError(DeviceCause::kDeviceFault, settings_.port + ": replies, but not to " +
                                                     std::to_string(kMostUnansweredChecks) +
                                                     " queries in a row for its errors");
  }
}

void Maestro::check_restart(std::uint32_t channel, unsigned position) {
  if (position != 0) return;
  // The late reply to a query for errors, before this one, would read as a channel without pulses.
  send_query(command(kGetPosition, {low7(channel)}));
  if (read_position() != 0) {
    throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": replies late: the position of channel " +
                                                   std::to_string(channel) + " was 0 for one of two queries");
  }
  unsigned errors = 0;
  try {
    errors = query_errors();
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
  }
  const std::string what =
      ": channel " + std::to_string(channel) + " has no pulses, though it was given a target";
  // A board that restarts in the middle of a command takes the rest of it for an error.
  if (errors != 0) {
    throw DeviceError(DeviceCause::kDeviceFault, settings_.port +
                                                     ": has restarted, or an error has sent its servos home" +
                                                     what + "; it reports " + describe_errors(errors));
  }
  throw DeviceError(DeviceCause::kDeviceFault, settings_.port + ": has restarted" + what);
}

void Maestro::refuse(unsigned errors) const {
  throw DeviceError(
      DeviceCause::kDeviceFault,
      settings_.port + ": the Maestro reports " + describe_errors(errors) +
          ((errors & kSerialTimeout) != 0 ? ": it got no command for longer than its Timeout setting" : ""));
}

void Maestro::send_query(const Bytes& bytes) {
  dialog_.discard_input();
  dialog_.write(bytes);
}

unsigned Maestro::query_errors() {
  send_query(command(kGetErrors, {}));
  const unsigned errors = read_word();
  if (errors <= kAllErrors) return errors;
  throw DeviceError(DeviceCause::kBadAnswer,
                    settings_.port + ": reports an unknown error code: check the line for disturbances");
}

unsigned Maestro::read_position() {
  const unsigned position = read_word();
  if (position <= kMostPosition) return position;
  throw DeviceError(DeviceCause::kBadAnswer,
                    settings_.port + ": reports an impossible position: check the line for disturbances");
}

unsigned Maestro::read_word() {
  std::array<std::uint8_t, 2> reply{};
  dialog_.read(reply);
  return reply[0] | static_cast<unsigned>(reply[1]) << 8;
}

}  // namespace corbot::rt
