// SPDX-License-Identifier: Apache-2.0
// A serial backend with the emulated controller that it speaks to, in the controller's own time.
#pragma once

#include <memory>
#include <string>

#include "rt/backends/serial/maestro.h"
#include "rt/backends/serial/ssc32.h"
#include "sim/devices/maestro_device.h"
#include "sim/devices/ssc32_device.h"
#include "support/emulated_line.h"

namespace corbot::rt {

using sim::MaestroDevice;
using sim::MaestroOptions;
using sim::Ssc32Device;
using sim::Ssc32Model;
using sim::Ssc32Options;
using test::EmulatedLine;
using test::EmulatedWire;

inline constexpr std::size_t kServos = 5;

inline ServoFrame all_at(double pulse_us) {
  ServoFrame frame;
  frame.servo_count = kServos;
  for (std::uint32_t i = 0; i < kServos; ++i) frame.channel[i] = i;
  frame.pulse_us.fill(pulse_us);
  return frame;
}

/// A backend with the controller that it speaks to; opened, and brought to 1500 us.
template <class Device, class Emulated, class Options, class Settings>
struct Bench {
  Bench(const Options& options, const Settings& settings)
      : emulated(options),
        wire(emulated, options.baud),
        device(settings, std::make_unique<EmulatedLine>(wire)) {
    (void)device.open();
  }
  void begin(double pulse_us = 1500.0) {
    device.send(all_at(pulse_us), true);
    wait_for_approach();
    device.send(all_at(pulse_us), false);
    wire.pass(0.1);
  }
  void wait_for_approach() { wire.pass(static_cast<double>(device.approach_ns()) * 1e-9); }
  /// The cause of what is thrown when the servos are sent there; kNone: nothing.
  DeviceCause cause_of(double pulse_us, std::string* why = nullptr) {
    try {
      device.send(all_at(pulse_us), false);
    } catch (const DeviceError& error) {
      if (why != nullptr) *why = error.what();
      return error.cause();
    }
    return DeviceCause::kNone;
  }
  Emulated emulated;
  EmulatedWire wire;
  Device device;
};

using Ssc32Base = Bench<Ssc32, Ssc32Device, Ssc32Options, Ssc32Settings>;
using MaestroBase = Bench<Maestro, MaestroDevice, MaestroOptions, MaestroSettings>;

struct Ssc32Bench : Ssc32Base {
  explicit Ssc32Bench(Ssc32Model model, int baud = 115200, bool readback = false, char stop_input = 0)
      : Ssc32Base({.model = model, .baud = baud}, {"/dev/ssc32", baud, readback, kServos, stop_input, true}) {
  }
};

struct MaestroBench : MaestroBase {
  explicit MaestroBench(bool readback = false, const MaestroOptions& options = {}, bool detect_baud = false)
      : MaestroBase(options,
                    {"/dev/maestro", options.baud, -1, false, readback, kServos, false, detect_baud}) {}
};

}  // namespace corbot::rt
