// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/ssc32.h"

#include <algorithm>
#include <cmath>

#include "rt/backends/serial/adapter_latency.h"

namespace corbot::rt {
namespace {

constexpr int kPulseMin_us = 500;
constexpr int kPulseMax_us = 2500;
constexpr const char* kModelU = "SSC-32U";
constexpr std::size_t kLongestVersion = 64;
/// The reply to QP of a channel that has had no pulse since power-up. It is the 500 us that the controller
/// assumes for every servo, or 0.
constexpr double kNeverCommanded_us = 500.0;
/// A servo whose last pulse was at least this long does not pass there.
constexpr double kSurelyCommanded_us = 600.0;
constexpr double kUnitOfQp_us = 10.0;

/// Tells whether a reply to a query for an input is valid. As a reply to QP it would be 480 or 490 us, which
/// is no position.
bool is_level(std::uint8_t reply) { return reply == '0' || reply == '1'; }

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

std::int64_t Ssc32::shortest_period_ns(std::size_t servos, int baud, bool readback, bool stop_input,
                                       std::optional<int> latency_ms) noexcept {
  constexpr std::size_t kBytesPerServo = 8;  // #31P2500
  constexpr std::size_t kBytesPerGroup = 7;  // T65535 and CR
  constexpr std::size_t kBytesPerQuery = 5;  // QP31 and the reply; one of them, and CR, in every frame
  constexpr std::size_t kBytesPerInput = 4;  // AL, CR and the reply
  constexpr std::int64_t kReply_ns = 5'000'000;
  const std::size_t bytes = servos * kBytesPerServo + kBytesPerGroup + kBytesPerQuery + 1 +
                            (readback ? servos * kBytesPerQuery + 1 : 0) + (stop_input ? kBytesPerInput : 0);
  // An adapter may keep each batch of replies: those to the query of every frame, to the input's query and to
  // readback.
  const std::int64_t kept_ns =
      latency_ms.value_or(0) > kGoodLatency_ms
          ? (1 + (readback ? 1 : 0) + (stop_input ? 1 : 0)) * std::int64_t{*latency_ms} * 1'000'000
          : 0;
  const std::int64_t replies_ns = (readback ? kReply_ns : 0) + (stop_input ? kReply_ns : 0) + kept_ns;
  const auto line_ns =
      static_cast<std::int64_t>(bytes * kBitsPerByte * 1'000'000'000ull / static_cast<unsigned>(baud));
  // Adds a tenth, so that a controller that is a little slow does not fall behind for ever.
  const std::int64_t period_ns = line_ns + line_ns / 10 + replies_ns;
  // If frames have a time, the reply to the first query is awaited.
  return period_ns <= kServoFrame_ns ? kServoFrame_ns : period_ns + kReply_ns;
}

std::string Ssc32::open() {
  dialog_.open(settings_.port, settings_.baud);
  is_served_ = is_reply_missing_ = false;
  given_ = 0;
  // Drops a command that was cut off when a plug was pulled; a CR would execute it.
  dialog_.write("\x1b");
  dialog_.discard_input();
  const std::string model = query_version();
  period_ns_ = shortest_period_ns(settings_.servos, settings_.baud, settings_.readback,
                                  settings_.stop_input != 0, dialog_.latency_ms());
  if (settings_.stop_input != 0) clear_latched_stop();
  dialog_.begin_service();
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return model + " on " + settings_.port + " at " + std::to_string(settings_.baud) +
         " baud: " + std::to_string(tenths_hz / 10) + "." + std::to_string(tenths_hz % 10) +
         " frames a second" +
         (period_ns_ > kServoFrame_ns ? ", all that the line carries; the servos could take 50" : "") +
         latency_warning(dialog_.latency_ms());
}

/// Discards the level that the input has latched before.
void Ssc32::clear_latched_stop() {
  try {
    (void)query_stop_input();
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    (void)query_stop_input();
  }
  input_.begin(Clock::now());
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

/// Sends a frame. The SSC-32 has no limit of acceleration: slow motions go there in small steps. A servo that
/// has had no pulse since power-up must get a plain one. With a time, an SSC-32 assumes that it begins at 500
/// us, and throws the arm there first. A controller whose power failed gets no frame: its reply before each
/// frame shows that, and without a reply there is no frame.
bool Ssc32::send(const ServoFrame& frame, bool) {
  is_served_ = true;
  if (!is_still_there()) return false;
  // Between frames that are far apart the controller interpolates.
  const bool interpolates = period_ns_ > kServoFrame_ns && frame.servo_count <= given_;
  dialog_.write(group(frame, interpolates ? static_cast<int>(period_ns_ / 1'000'000) : 0));
  last_ = frame;
  given_ = frame.servo_count;
  return true;
}

bool Ssc32::is_still_there() {
  queried_ = 0;
  for (std::size_t i = 1; i < given_; ++i) {
    if (last_.pulse_us[i] > last_.pulse_us[queried_]) queried_ = i;
  }
  std::uint8_t reply = 0;
  try {
    is_reply_missing_ = true;
    query("QP" + std::to_string(last_.channel[queried_]) + "\r", {&reply, 1});
    is_reply_missing_ = false;
    check_restart(queried_, reply);
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
    return false;
  }
  dialog_.note_reply();
  return true;
}

BusReading Ssc32::measure(const ServoFrame& frame) {
  if (!is_served_) return {BusReading::Unit::kPulses, stable_pulses(frame), {}, kUnitOfQp_us};
  try {
    const BusReading reading{BusReading::Unit::kPulses, query(frame), {}, kUnitOfQp_us};
    dialog_.note_reply();
    return reading;
  } catch (const DeviceError& error) {
    dialog_.note_miss(error);
  }
  return {};
}

StopInputLevel Ssc32::emergency_stop() {
  if (settings_.stop_input == 0) return StopInputLevel::kReleased;
  if (!input_.is_due(Clock::now())) return input_.look();
  const bool was_heard = input_.is_heard();
  try {
    const bool is_pressed = query_stop_input();
    input_.note(is_pressed, Clock::now());
    if (!was_heard) log_ = settings_.port + ": input " + settings_.stop_input + " answers again";
  } catch (const DeviceError& error) {
    if (!is_noise(error.cause())) throw;
    input_.note_miss(Clock::now());
    if (!was_heard || input_.is_heard()) return input_.look();
    log_ = settings_.port + ": the emergency stop at input " + settings_.stop_input +
           " cannot be read, so it counts as pressed: " + error.what();
  }
  return input_.look();
}

bool Ssc32::query_stop_input() {
  // The controller latches a low level, not a high one.
  std::uint8_t level = 0;
  query(std::string(1, settings_.stop_input) + (settings_.stop_at_high ? "\r" : "L\r"), {&level, 1});
  // With a pulse offset, 500 us may be reported as 480 or 490. A late reply would then be taken for a level.
  const bool may_be_pulse = is_reply_missing_ && last_.pulse_us[queried_] < kSurelyCommanded_us;
  if (!is_level(level) || may_be_pulse) {
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
  dialog_.discard_input();
  dialog_.write(text);
  dialog_.read(reply);
}

void Ssc32::check_restart(std::size_t servo, std::uint8_t reply) {
  if (servo >= given_ || last_.pulse_us[servo] < kSurelyCommanded_us || !is_never_commanded(reply)) return;
  // One garbled or late byte reads like that, too.
  query("QP" + std::to_string(last_.channel[servo]) + "\r", {&reply, 1});
  if (!is_never_commanded(reply)) {
    throw DeviceError(DeviceCause::kBadAnswer, settings_.port + ": two queries for the pulse of channel " +
                                                   std::to_string(last_.channel[servo]) +
                                                   " have different replies");
  }
  throw DeviceError(DeviceCause::kDeviceFault, settings_.port + ": has restarted: it has given channel " +
                                                   std::to_string(last_.channel[servo]) +
                                                   " no pulse since corbot's last command");
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
