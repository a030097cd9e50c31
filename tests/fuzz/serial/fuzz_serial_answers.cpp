// SPDX-License-Identifier: Apache-2.0
// Serial controllers that answer whatever they like. The first byte says which controller is spoken to and
// how, the rest is what it answers; a line that has no more to say is one without an answer.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "rt/backends/serial/maestro.h"
#include "rt/backends/serial/ssc32.h"

namespace {

using namespace corbot;
using namespace corbot::rt;

class HostileLine final : public SerialLine {
 public:
  explicit HostileLine(std::span<const std::uint8_t> answers) : answers_(answers) {}
  void open(const std::string&, int) override {}
  void close() noexcept override {}
  void write(std::span<const std::uint8_t> bytes, Clock::time_point) override {
    if (bytes.empty() || bytes.size() > 1024) std::abort();  // nothing said, or without bound
  }
  void read_exactly(std::span<std::uint8_t> into, Clock::time_point) override {
    if (into.size() > answers_.size()) throw DeviceError(DeviceCause::kNoAnswer, "no answer");
    std::copy_n(answers_.begin(), into.size(), into.begin());
    answers_ = answers_.subspan(into.size());
  }
  void discard_input() override {}

 private:
  std::span<const std::uint8_t> answers_;
};

void use(BusDevice& device, double highest_us) {
  ServoFrame frame;
  frame.servo_count = 5;
  for (std::uint32_t i = 0; i < frame.servo_count; ++i) {
    frame.channel[i] = i;
    frame.pulse_us[i] = 1500.0;
  }
  try {
    const std::string log = device.open();
    if (log.empty() || log.size() > 400) std::abort();
    for (const char c : log) {
      if (c < 0x20 || c > 0x7e) std::abort();  // it goes into a log
    }
    if (device.period_ns() < 1'000'000) std::abort();
    for (int i = 0; i < 60; ++i) {
      device.send(frame, i == 0 && device.approach_ns() > 0);
      (void)device.emergency_stop();
      const BusReading reading = device.measure(frame);
      for (std::uint32_t servo = 0; servo < frame.servo_count; ++servo) {
        const double pulse_us = reading.value[servo];
        if (!std::isfinite(pulse_us) || pulse_us < 0.0 || pulse_us > highest_us) std::abort();
      }
    }
    device.relax();
  } catch (const DeviceError& error) {
    if (std::string(error.what()).empty() || error.cause() == DeviceCause::kNone) std::abort();
  }
  device.close();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const unsigned choice = data[0];
  auto line = std::make_unique<HostileLine>(std::span(data, size).subspan(1));
  if ((choice & 1u) != 0) {
    Ssc32Settings settings;
    settings.port = "/dev/hostile";
    settings.readback = (choice & 2u) != 0;
    Ssc32 device(settings, std::move(line));
    use(device, 2550.0);
  } else {
    MaestroSettings settings;
    settings.port = "/dev/hostile";
    settings.readback = (choice & 2u) != 0;
    settings.crc = (choice & 4u) != 0;
    settings.device_number = (choice & 8u) != 0 ? 12 : -1;
    Maestro device(settings, std::move(line));
    use(device, 16383.75);
  }
  return 0;
}
