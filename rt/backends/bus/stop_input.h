// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/backend/emergency_stop.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// For the thread that serves the device. An input that cannot be read counts as pressed. Its last state
/// stays set, so that there is no instant at which neither source is active. Throws DeviceError.
inline void read_stop_input(BusDevice& device, EmergencyStop& stop) {
  const StopInputLevel input = device.emergency_stop();
  if (input != StopInputLevel::kUnheard) stop.set(StopSource::kDevice, input == StopInputLevel::kPressed);
  stop.set(StopSource::kDeviceUnheard, input == StopInputLevel::kUnheard);
}

/// Marks the stop input of a lost device as unreadable, if it has one.
inline void lose_stop_input(const BusDevice& device, EmergencyStop& stop) noexcept {
  if (device.has_stop_input()) stop.set(StopSource::kDeviceUnheard, true);
}

}  // namespace corbot::rt
