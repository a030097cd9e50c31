// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rt/backends/serial/serial_port.h"
#include "sim/devices/byte_line.h"
#include "sim/devices/serial_device.h"

namespace corbot::test {

/// An emulated controller and the time that its line takes, without a terminal or waiting. Bytes written and
/// read advance the clock, and so does pass().
struct EmulatedWire {
  EmulatedWire(sim::SerialDevice& end, int baud) : device(end), byte_ns(10'000'000'000 / baud) {}

  void pass(double seconds) { now_ns += static_cast<std::int64_t>(seconds * 1e9); }
  [[nodiscard]] double pulse_us(std::size_t channel) { return device.pulse_us(channel, now_ns); }

  sim::SerialDevice& device;
  const std::int64_t byte_ns;
  std::int64_t now_ns{1'000 * 1'000'000'000ll};
  std::vector<std::uint8_t> answered;  ///< and not read yet
  std::string written;                 ///< all of it
  int lose{0};                         ///< so many bytes of the next answers
  int garble{0};                       ///< all bits of so many bytes of the answers after these
  bool is_silent{false};
  std::chrono::nanoseconds longest_wait{};  ///< that was granted to an answer
};

class EmulatedLine final : public rt::SerialLine {
 public:
  explicit EmulatedLine(EmulatedWire& wire) : wire_(wire) {}

  void open(const std::string&, int) override {}
  void close() noexcept override {}
  void write(std::span<const std::uint8_t> bytes, Clock::time_point) override {
    for (const std::uint8_t byte : bytes) {
      wire_.now_ns += wire_.byte_ns;
      wire_.device.receive({&byte, 1}, wire_.now_ns);
      wire_.written += static_cast<char>(byte);
    }
  }
  void read_exactly(std::span<std::uint8_t> into, Clock::time_point deadline) override {
    wire_.longest_wait = std::max<std::chrono::nanoseconds>(wire_.longest_wait, deadline - Clock::now());
    const std::int64_t deadline_ns = wire_.now_ns + 30'000'000;
    fetch();
    while (wire_.answered.size() < into.size()) {
      const auto next_ns = wire_.device.next_answer_ns();
      wire_.now_ns = std::clamp(next_ns.value_or(deadline_ns), wire_.now_ns, deadline_ns);
      if (!next_ns || *next_ns > deadline_ns)
        throw rt::DeviceError(DeviceCause::kNoAnswer, "emulated: no answer");
      fetch();
    }
    std::copy_n(wire_.answered.begin(), into.size(), into.begin());
    wire_.answered.erase(wire_.answered.begin(),
                         wire_.answered.begin() + static_cast<std::ptrdiff_t>(into.size()));
  }
  void discard_input() override {
    fetch();
    wire_.answered.clear();
  }

 private:
  void fetch() {
    for (std::uint8_t byte : wire_.device.answers(wire_.now_ns)) {
      if (wire_.is_silent || (wire_.lose > 0 && wire_.lose-- > 0)) continue;
      if (wire_.garble > 0 && wire_.garble-- > 0) byte = static_cast<std::uint8_t>(~byte);
      wire_.answered.push_back(byte);
    }
  }

  EmulatedWire& wire_;
};

}  // namespace corbot::test
