// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/ssc32_device.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace corbot::sim {
namespace {

constexpr std::uint8_t kCr = 0x0D;
constexpr std::uint8_t kEsc = 0x1B;
constexpr std::uint8_t kMiniSscSync = 0xFF;
constexpr double kMiniSscLast = 254.0;
constexpr std::size_t kLongestLine = 512;
constexpr std::size_t kMostReplied = 1024;
constexpr int kUnitOfQp_us = 10;
/// The position that an SSC-32 assumes for a servo that it has not moved yet.
constexpr int kAssumed_us = 500;
constexpr double kHighVolts = 2.5;

std::string version_of(const Ssc32Options& options) {
  if (!options.version.empty()) return options.version;
  return options.model == Ssc32Model::kSsc32U ? "SSC32-V2.50USB" : "SSC32-1.06XE";
}

/// Returns the time that a servo takes at its speed limit, rounded up.
std::int64_t shortest_ns(int distance_us, int speed_us_per_s) {
  const std::int64_t scaled = std::int64_t{1'000'000'000} * std::abs(distance_us);
  return speed_us_per_s > 0 ? (scaled + speed_us_per_s - 1) / speed_us_per_s : 0;
}

}  // namespace

Ssc32Device::Ssc32Device(Ssc32Options options)
    : SerialDevice({"position", "moving", "version", "input", "analog"}),
      options_(std::move(options)),
      frames_(kSsc32Channels, options_.servo, options_.shaft_us),
      line_out_(options_.baud, kMostReplied) {
  options_.version = version_of(options_);
}

int Ssc32Device::Channel::position_us(std::int64_t time_ns) const {
  if (time_ns >= end_ns || end_ns <= start_ns) return to_us;
  const double share = static_cast<double>(time_ns - start_ns) / static_cast<double>(end_ns - start_ns);
  return static_cast<int>(std::lround(from_us + std::max(share, 0.0) * (to_us - from_us)));
}

void Ssc32Device::advance(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns);
  frames_.advance(now_ns_, [this](std::size_t i, std::int64_t time_ns) {
    const Channel& channel = channels_[i];
    return channel.has_position ? double(channel.position_us(time_ns) + channel.offset_us) : 0.0;
  });
}

void Ssc32Device::receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  advance(now_ns);
  for (const std::uint8_t byte : bytes) take_byte(byte);
}

std::vector<std::uint8_t> Ssc32Device::answers(std::int64_t now_ns) {
  advance(now_ns);
  std::vector<std::uint8_t> bytes;
  while (const auto byte = line_out_.pop(now_ns_)) bytes.push_back(byte->value);
  return bytes;
}

std::optional<std::int64_t> Ssc32Device::next_answer_ns() const {
  return line_out_.is_empty() ? std::nullopt : std::optional(line_out_.next_ns());
}

double Ssc32Device::pulse_us(std::size_t channel, std::int64_t now_ns) {
  advance(now_ns);
  return frames_.pulse_us(channel);
}

double Ssc32Device::shaft_us(std::size_t channel, std::int64_t now_ns) {
  advance(now_ns);
  return frames_.shaft_us(channel, now_ns_);
}

void Ssc32Device::power_cycle(std::int64_t now_ns) {
  advance(now_ns);
  frames_.stop();
  line_out_.clear();
  channels_.fill({});
  for (Pin& pin : pins_) pin = Pin{pin.volts, pin.volts < kHighVolts, false};
  line_.clear();
  is_line_too_long_ = false;
  mini_ssc_bytes_ = 0;
}

bool Ssc32Device::set_input(char name, bool is_high) {
  if (name < 'A' || name >= 'A' + ssc32::digital_inputs(options_.model)) return false;
  return set_analog(name, is_high ? 5.0 : 0.0);
}

bool Ssc32Device::set_analog(char name, double volts) {
  if (name < 'A' || name >= 'A' + ssc32::analog_inputs(options_.model) || !(volts >= 0.0 && volts <= 5.0)) {
    return false;
  }
  Pin& pin = pins_[static_cast<std::size_t>(name - 'A')];
  pin.volts = volts;
  pin.was_low = pin.was_low || volts < kHighVolts;
  return true;
}

std::optional<bool> Ssc32Device::output(std::size_t channel) const {
  return channel < channels_.size() ? channels_[channel].output : std::nullopt;
}

void Ssc32Device::take_byte(std::uint8_t byte) {
  if (mini_ssc_bytes_ > 0 || (byte == kMiniSscSync && line_.empty())) {
    take_mini_ssc(byte);
  } else if (byte == kCr) {
    run_line();
  } else if (byte == kEsc) {
    line_.clear();
    is_line_too_long_ = false;
  } else if (byte != ' ' && byte != '\t' && byte != '\n') {
    const bool is_small = byte >= 'a' && byte <= 'z';
    if (line_.size() < kLongestLine) {
      line_ += static_cast<char>(is_small ? byte - ('a' - 'A') : byte);
    } else {
      is_line_too_long_ = true;
    }
  }
}

void Ssc32Device::take_mini_ssc(std::uint8_t byte) {
  if (byte == kMiniSscSync) {  // neither a channel nor a position is 255: another command begins
    if (mini_ssc_bytes_ > 0) ++bad_input_count_;
    mini_ssc_bytes_ = 1;
  } else if (mini_ssc_bytes_ == 1) {
    mini_ssc_channel_ = byte;
    mini_ssc_bytes_ = 2;
  } else {
    mini_ssc_bytes_ = 0;
    if (mini_ssc_channel_ >= kSsc32Channels) {
      ++bad_input_count_;
      return;
    }
    const double range_us = options_.mini_ssc_last_us - options_.mini_ssc_first_us;
    const double pulse_us = options_.mini_ssc_first_us + byte / kMiniSscLast * range_us;
    jump(channels_[mini_ssc_channel_], static_cast<int>(std::lround(pulse_us)));
  }
}

void Ssc32Device::run_line() {
  const std::string line = std::exchange(line_, {});
  const bool is_bad = std::exchange(is_line_too_long_, false);
  if (line.empty()) return;
  const auto command = is_bad ? std::nullopt : ssc32::parse(line, options_.model);
  if (!command) {
    ++bad_input_count_;
    return;
  }
  std::visit([this](const auto& what) { execute(what); }, *command);
}

void Ssc32Device::answer(std::string_view query, std::vector<std::uint8_t> bytes) {
  const std::int64_t delay_ns = faults().apply(query, bytes);
  for (const std::uint8_t byte : bytes) (void)line_out_.push(byte, now_ns_ + delay_ns);
}

void Ssc32Device::jump(Channel& channel, int pulse_us) const {
  const int offset_us = channel.offset_us;
  channel = Channel{true, pulse_us, pulse_us, now_ns_, now_ns_, now_ns_, offset_us, std::nullopt};
}

void Ssc32Device::execute(const ssc32::GroupMove& group) {
  const bool has_speed =
      std::any_of(group.moves.begin(), group.moves.end(), [](const auto& m) { return m.speed_us_per_s > 0; });
  const bool is_timed = has_speed || group.time_ms > 0;
  // The first move of a servo: an SSC-32 goes there from its assumed position, an SSC-32U at once.
  const auto jumps = [&](const Channel& channel) {
    return !is_timed || (!channel.has_position && options_.model == Ssc32Model::kSsc32U);
  };
  const auto start_us = [&](const Channel& channel) {
    return channel.has_position ? channel.position_us(now_ns_) : kAssumed_us;
  };
  std::int64_t duration_ns = std::int64_t{1'000'000} * group.time_ms;
  for (const ssc32::ServoMove& move : group.moves) {
    const Channel& channel = channels_[static_cast<std::size_t>(move.channel)];
    if (jumps(channel)) continue;
    duration_ns = std::max(duration_ns, shortest_ns(move.pulse_us - start_us(channel), move.speed_us_per_s));
  }
  for (const ssc32::ServoMove& move : group.moves) {
    Channel& channel = channels_[static_cast<std::size_t>(move.channel)];
    const int from_us = jumps(channel) ? move.pulse_us : start_us(channel);
    const std::int64_t end_ns = now_ns_ + (jumps(channel) ? 0 : duration_ns);
    jump(channel, move.pulse_us);
    channel.from_us = from_us;
    channel.end_ns = channel.busy_until_ns = end_ns;
  }
}

void Ssc32Device::execute(const ssc32::Offsets& offsets) {
  for (const auto& [channel, offset_us] : offsets) {
    channels_[static_cast<std::size_t>(channel)].offset_us = offset_us;
  }
}

void Ssc32Device::execute(const ssc32::Levels& levels) {
  for (const auto& [channel, is_high] : levels) {
    Channel& what = channels_[static_cast<std::size_t>(channel)];
    what = Channel{.offset_us = what.offset_us, .output = is_high};
  }
}

void Ssc32Device::execute(const ssc32::QueryMoving&) {
  const bool is_busy = std::any_of(channels_.begin(), channels_.end(),
                                   [&](const Channel& channel) { return channel.busy_until_ns > now_ns_; });
  answer("moving", {static_cast<std::uint8_t>(is_busy ? '+' : '.')});
}

void Ssc32Device::execute(const ssc32::QueryPulses& query) {
  const int assumed_us = options_.model == Ssc32Model::kSsc32 ? kAssumed_us : 0;
  std::vector<std::uint8_t> bytes;
  for (const int which : query.channels) {
    const Channel& channel = channels_[static_cast<std::size_t>(which)];
    const int position_us = channel.has_position ? channel.position_us(now_ns_) : assumed_us;
    bytes.push_back(static_cast<std::uint8_t>(position_us / kUnitOfQp_us));
  }
  answer("position", std::move(bytes));
}

void Ssc32Device::execute(const ssc32::QueryVersion&) {
  const std::string text = options_.version + '\r';
  answer("version", {text.begin(), text.end()});
}

void Ssc32Device::execute(const ssc32::Stop& stop) {
  Channel& channel = channels_[static_cast<std::size_t>(stop.channel)];
  if (!channel.has_position) return;
  channel.from_us = channel.to_us = channel.position_us(now_ns_);
  channel.end_ns = now_ns_;
}

void Ssc32Device::execute(const ssc32::DigitalReads& reads) {
  std::vector<std::uint8_t> bytes;
  for (const auto& [which, is_latching] : reads) {
    Pin& pin = pins_[static_cast<std::size_t>(which)];
    const bool is_high = pin.volts >= kHighVolts;
    const bool has_been_low = is_latching && std::exchange(pin.was_low, !is_high);
    bytes.push_back(is_high && !has_been_low ? '1' : '0');
  }
  answer("input", std::move(bytes));
}

void Ssc32Device::execute(const ssc32::AnalogReads& reads) {
  std::vector<std::uint8_t> bytes;
  for (const int which : reads.pins) {
    Pin& pin = pins_[static_cast<std::size_t>(which)];
    const int value = std::min(static_cast<int>(pin.volts * 256.0 / 5.0), 255);
    bytes.push_back(static_cast<std::uint8_t>(std::exchange(pin.is_analog_valid, true) ? value : 0));
  }
  answer("analog", std::move(bytes));
}

}  // namespace corbot::sim
