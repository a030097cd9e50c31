// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/maestro_device.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace corbot::sim {
namespace {

constexpr std::uint8_t kSetTarget = 0x84;
constexpr std::uint8_t kSetSpeed = 0x87;
constexpr std::uint8_t kSetAcceleration = 0x89;
constexpr std::uint8_t kGetPosition = 0x90;
constexpr std::uint8_t kGetMovingState = 0x93;
constexpr std::uint8_t kSetMultipleTargets = 0x9F;
constexpr std::uint8_t kGetErrors = 0xA1;
constexpr std::uint8_t kGoHome = 0xA2;
/// Before a device number: the Pololu protocol. Alone, to a board that is set to detect it: the byte that
/// shows the baud.
constexpr std::uint8_t kPololu = 0xAA;
constexpr std::uint8_t kMiniSsc = 0xFF;
constexpr std::uint8_t kCommandBit = 0x80;

constexpr std::int64_t kStep_ns = 10'000'000;
constexpr int kEighths = 8;
constexpr double kQuartersPerMicrosecond = 4.0;
constexpr double kMiniSscNeutral = 127.0;
constexpr int kMostAcceleration = 255;
constexpr std::size_t kMostAnswered = 1024;

/// Returns the maker's CRC-7: the polynomial x^7 + x^3 + 1, the least significant bit of each byte first.
std::uint8_t crc7(std::span<const std::uint8_t> bytes) {
  constexpr unsigned kPolynomialReversed = 0x91;
  unsigned remainder = 0;
  for (const std::uint8_t byte : bytes) {
    remainder ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      if ((remainder & 1u) != 0) remainder ^= kPolynomialReversed;
      remainder >>= 1;
    }
  }
  return static_cast<std::uint8_t>(remainder);
}

/// Returns the number of data bytes of a command, without the CRC; empty: no such command. `data`: the bytes
/// received.
std::optional<std::size_t> length_of(std::uint8_t command, std::span<const std::uint8_t> data) {
  switch (command) {
    case kSetTarget:
    case kSetSpeed:
    case kSetAcceleration:
      return 3;
    case kGetPosition:
      return 1;
    case kGetMovingState:
    case kGetErrors:
    case kGoHome:
      return 0;
    case kSetMultipleTargets:
      return data.empty() ? 2 : 2 + 2 * std::size_t{data[0]};
    default:
      return std::nullopt;
  }
}

int quarters(double us) { return static_cast<int>(std::lround(us * kQuartersPerMicrosecond)); }

int seven_bit(std::uint8_t low, std::uint8_t high) { return low | high << 7; }

/// Returns the fastest step from which it can stop within `distance`, slowing down by `deceleration` a step.
int braking_speed(int distance, int deceleration) {
  const double ratio = static_cast<double>(distance) / deceleration;
  const int steps = std::max(1, static_cast<int>(std::ceil((std::sqrt(1.0 + 8.0 * ratio) - 1.0) / 2.0)));
  return (distance + deceleration * (steps * (steps - 1) / 2)) / steps;
}

}  // namespace

void MaestroDevice::Channel::step(int lowest, int highest) {
  const int sign = target < position ? -1 : 1;
  const int distance = std::abs(target - position);
  int forward = distance;
  if (speed > 0) forward = std::min(forward, speed);
  if (acceleration > 0) {
    const int now = velocity * sign;
    forward = std::min({forward, now + acceleration, braking_speed(distance, acceleration)});
    forward = std::max(forward, now - acceleration);
  }
  // It passes the target only if the target has come too near to stop; it never passes the limits.
  const int before = std::exchange(position, std::clamp(position + forward * sign, lowest, highest));
  velocity = position - before;
  if (is_at_target() && std::abs(velocity) <= std::max(acceleration, 1)) velocity = 0;
}

MaestroDevice::MaestroDevice(const MaestroOptions& options)
    : SerialDevice({"position", "moving", "errors"}),
      options_(options),
      frames_(options.channels, options.servo, options.shaft_us),
      line_out_(options.baud, kMostAnswered),
      channels_(options.channels),
      knows_baud_(!options.detects_baud) {}

void MaestroDevice::let_move(std::int64_t time_ns) {
  const std::int64_t latest_ns = time_ns - time_ns % kStep_ns;
  const int lowest = kEighths * quarters(options_.min_us);
  const int highest = kEighths * quarters(options_.max_us);
  for (; step_ns_ < latest_ns; step_ns_ += kStep_ns) {
    bool is_moving = false;
    for (Channel& channel : channels_) {
      if (channel.is_at_target() && channel.velocity == 0) continue;
      channel.step(lowest, highest);
      is_moving = true;
    }
    if (!is_moving) break;
  }
  step_ns_ = std::max(step_ns_, latest_ns);
}

void MaestroDevice::advance(std::int64_t now_ns) {
  if (command_ns_ == 0) command_ns_ = now_ns;  // its power-up
  const std::int64_t timeout_ns = std::int64_t{1'000'000} * options_.timeout_ms;
  if (timeout_ns > 0 && now_ns - command_ns_ > timeout_ns) {
    advance_to(command_ns_ + timeout_ns);
    fail(kSerialTimeout);
    command_ns_ = now_ns;
  }
  advance_to(now_ns);
}

void MaestroDevice::advance_to(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns);
  frames_.advance(now_ns_, [this](std::size_t i, std::int64_t time_ns) {
    let_move(time_ns);
    const int whole_quarters = channels_[i].position / kEighths;
    return whole_quarters / kQuartersPerMicrosecond;
  });
  let_move(now_ns_);
}

void MaestroDevice::receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  advance(now_ns);
  for (const std::uint8_t byte : bytes) take_byte(byte);
}

std::vector<std::uint8_t> MaestroDevice::answers(std::int64_t now_ns) {
  advance(now_ns);
  std::vector<std::uint8_t> bytes;
  while (const auto byte = line_out_.pop(now_ns_)) bytes.push_back(byte->value);
  return bytes;
}

std::optional<std::int64_t> MaestroDevice::next_answer_ns() const {
  return line_out_.is_empty() ? std::nullopt : std::optional(line_out_.next_ns());
}

double MaestroDevice::pulse_us(std::size_t channel, std::int64_t now_ns) {
  advance(now_ns);
  return frames_.pulse_us(channel);
}

double MaestroDevice::shaft_us(std::size_t channel, std::int64_t now_ns) {
  advance(now_ns);
  return frames_.shaft_us(channel, now_ns_);
}

void MaestroDevice::power_cycle(std::int64_t now_ns) {
  advance(now_ns);
  frames_.stop();
  line_out_.clear();
  std::fill(channels_.begin(), channels_.end(), Channel{});
  packet_.clear();
  is_skipping_ = false;
  errors_ = 0;
  knows_baud_ = !options_.detects_baud;
  command_ns_ = now_ns;
}

void MaestroDevice::take_byte(std::uint8_t byte) {
  if (!knows_baud_) {
    knows_baud_ = byte == kPololu;
  } else if (!packet_.empty() && packet_[0] == kMiniSsc) {
    take_mini_ssc_byte(byte);
  } else if ((byte & kCommandBit) != 0) {
    take_command_byte(byte);
  } else {
    take_data_byte(byte);
  }
}

void MaestroDevice::take_command_byte(std::uint8_t byte) {
  const bool is_baud_byte = options_.detects_baud && packet_.size() == 1 && packet_[0] == kPololu;
  if (!packet_.empty() && !is_baud_byte) fail(kSerialProtocolError);
  packet_ = {byte};
  is_skipping_ = false;
  if (byte != kPololu && byte != kMiniSsc) finish_packet(1);
}

void MaestroDevice::take_data_byte(std::uint8_t byte) {
  if (is_skipping_) return;
  if (packet_.empty()) {
    fail(kSerialProtocolError);
    return;
  }
  packet_.push_back(byte);
  if (packet_[0] != kPololu) {
    finish_packet(1);
  } else if (packet_.size() == 2 && byte != options_.device_number) {
    packet_.clear();
    is_skipping_ = true;
  } else if (packet_.size() > 2) {
    finish_packet(3);
  }
}

void MaestroDevice::take_mini_ssc_byte(std::uint8_t byte) {
  if (byte == kMiniSsc) {  // neither a servo's number nor a position is 255: another command begins
    fail(kSerialProtocolError);
    packet_ = {byte};
    return;
  }
  packet_.push_back(byte);
  if (packet_.size() < 3) return;
  const int channel = packet_[1] - options_.mini_ssc_offset;
  const double share = (packet_[2] - kMiniSscNeutral) / kMiniSscNeutral;
  packet_.clear();
  command_ns_ = now_ns_;
  // Other numbers are those of other boards on the line.
  if (channel < 0 || static_cast<std::size_t>(channel) >= channels_.size()) return;
  set_target(static_cast<std::size_t>(channel),
             quarters(options_.mini_ssc_neutral_us + share * options_.mini_ssc_range_us));
}

/// Executes the packet if it is complete.
void MaestroDevice::finish_packet(std::size_t data_begin) {
  const auto command = static_cast<std::uint8_t>(packet_[data_begin - 1] | kCommandBit);
  const std::span<const std::uint8_t> all(packet_);
  const bool is_known = command != kSetMultipleTargets || options_.multi_target;
  const auto length = is_known ? length_of(command, all.subspan(data_begin)) : std::nullopt;
  if (!length || *length > 2 + 2 * channels_.size()) {
    packet_.clear();
    is_skipping_ = true;
    fail(kSerialProtocolError);
    return;
  }
  const std::size_t end = data_begin + *length;
  if (all.size() < end + (options_.crc ? 1 : 0)) return;
  const std::vector<std::uint8_t> packet = std::move(packet_);
  packet_.clear();
  const std::span<const std::uint8_t> message(packet.data(), end);
  if (options_.crc && packet[end] != crc7(message)) {
    fail(kSerialCrcError);
    return;
  }
  command_ns_ = now_ns_;
  execute(command, message.subspan(data_begin));
}

void MaestroDevice::execute(std::uint8_t command, std::span<const std::uint8_t> data) {
  switch (command) {
    case kGetMovingState:
      answer(
          "moving",
          std::all_of(channels_.begin(), channels_.end(), [](const Channel& c) { return c.is_at_target(); })
              ? 0
              : 1,
          1);
      break;
    case kGetErrors:
      answer("errors", errors_, 2);
      errors_ = 0;
      break;
    case kGoHome:
      go_home();
      break;
    case kSetMultipleTargets: {
      const std::size_t count = data[0];
      const std::size_t first = data[1];
      if (count == 0 || first + count > channels_.size()) return fail(kSerialProtocolError);
      for (std::size_t i = 0; i < count; ++i) {
        set_target(first + i, seven_bit(data[2 + 2 * i], data[3 + 2 * i]));
      }
      break;
    }
    default:
      for_channel(command, data);
  }
}

void MaestroDevice::for_channel(std::uint8_t command, std::span<const std::uint8_t> data) {
  const std::size_t which = data[0];
  if (which >= channels_.size()) return fail(kSerialProtocolError);
  Channel& channel = channels_[which];
  if (command == kGetPosition) {
    return answer("position", static_cast<unsigned>(channel.position / kEighths), 2);
  }
  const int value = seven_bit(data[1], data[2]);
  switch (command) {
    case kSetTarget:
      set_target(which, value);
      break;
    case kSetSpeed:
      channel.speed = value * kEighths;
      break;
    default:
      channel.acceleration = std::min(value, kMostAcceleration);
      break;
  }
}

void MaestroDevice::set_target(std::size_t which, int target_quarters) {
  Channel& channel = channels_[which];
  channel.target = 0;
  if (target_quarters != 0) {
    channel.target =
        kEighths * std::clamp(target_quarters, quarters(options_.min_us), quarters(options_.max_us));
  }
  // A servo that has no pulses may be anywhere: limits have no effect on its first target.
  const bool is_limited = channel.position > 0 && (channel.speed > 0 || channel.acceleration > 0);
  if (is_limited && channel.target > 0) return;
  channel.position = channel.target;
  channel.velocity = 0;
}

void MaestroDevice::go_home() {
  for (std::size_t i = 0; i < channels_.size(); ++i) set_target(i, quarters(options_.home_us));
}

void MaestroDevice::fail(unsigned error) {
  errors_ |= error;
  if (options_.errors_go_home) go_home();
}

void MaestroDevice::answer(std::string_view query, unsigned value, int bytes) {
  std::vector<std::uint8_t> all;
  for (int i = 0; i < bytes; ++i) all.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  const std::int64_t delay_ns = faults().apply(query, all);
  for (const std::uint8_t byte : all) (void)line_out_.push(byte, now_ns_ + delay_ns);
}

}  // namespace corbot::sim
