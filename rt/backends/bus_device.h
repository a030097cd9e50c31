// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "corbot/backend/backend.h"
#include "rt/backends/serial_port.h"

namespace corbot::rt {

/// A servo controller on a bus that may block: what BusBackend's thread talks to. Nothing here is real-time
/// safe; every failure throws DeviceError.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  /// Opens and finds out what it is. Returns what to tell the operator: the model, the rate that the bus
  /// allows.
  virtual std::string open() = 0;
  virtual void close() noexcept = 0;
  /// Shortest time between two frames that the bus can carry, known after open().
  [[nodiscard]] virtual std::int64_t period_ns() const noexcept = 0;
  /// Hands a frame over. `approach` asks for a slow motion to it, from wherever the servos are.
  virtual void send(const ServoFrame& frame, bool approach) = 0;
  /// How long a slow approach takes.
  [[nodiscard]] virtual std::int64_t approach_ns() const noexcept = 0;
  /// Asks for the servos' positions, as pulses; false where the device cannot tell. Also proves that it is
  /// alive.
  virtual bool measure(const ServoFrame& frame, std::array<double, kMaxServos>& pulse_us) = 0;
  /// The last thing sent: servos without pulses, where the profile wants that.
  virtual void relax() = 0;
};

}  // namespace corbot::rt
