// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/maestro_device.h"
#include "sim/devices/ssc32_device.h"

namespace corbot::sim {

/// A device and its clock, in milliseconds; time 0 is the beginning of a servo frame.
template <class Device, class Options>
class DeviceBench {
 public:
  explicit DeviceBench(const Options& options = {}) : device(options) {}

  /// Sends it all in no time.
  void send(std::string_view text, double at_ms) {
    send_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, at_ms);
  }
  void send(std::initializer_list<std::uint8_t> bytes, double at_ms) {
    send_bytes({bytes.begin(), bytes.size()}, at_ms);
  }
  void send_bytes(std::span<const std::uint8_t> bytes, double at_ms) { device.receive(bytes, ns(at_ms)); }

  /// Returns the bytes that have left the device by then.
  std::string answers(double at_ms) {
    const std::vector<std::uint8_t> bytes = device.answers(ns(at_ms));
    return {bytes.begin(), bytes.end()};
  }
  /// Everything that it answers to this; the clock goes on by a second.
  std::string ask(std::string_view text, double at_ms) {
    send(text, at_ms);
    return answers(at_ms + 1000.0);
  }
  double pulse_us(std::size_t channel, double at_ms) { return device.pulse_us(channel, ns(at_ms)); }
  double shaft_us(std::size_t channel, double at_ms) { return device.shaft_us(channel, ns(at_ms)); }

  static std::int64_t ns(double ms) { return kBegin_ns + static_cast<std::int64_t>(ms * 1e6); }

  Device device;

 private:
  static constexpr std::int64_t kBegin_ns = 1'000'000 * kServoFrame_ns;
};

using Ssc32Bench = DeviceBench<Ssc32Device, Ssc32Options>;
using MaestroBench = DeviceBench<MaestroDevice, MaestroOptions>;

inline Ssc32Options older() { return {.model = Ssc32Model::kSsc32}; }

}  // namespace corbot::sim
