// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// The reason why a device is degraded, lost, or cannot be opened. Snapshot, alarm and client get its number;
/// docs/alarms.md lists the numbers.
enum class DeviceCause : std::uint32_t {
  kNone,
  kNotThere,      ///< cannot be opened
  kInUse,         ///< another program has it
  kHungUp,        ///< the plug was pulled
  kWriteTimeout,  ///< accepts no more bytes
  kNoAnswer,
  kBadAnswer,
  kDeviceFault,    ///< the device itself reports a fault
  kBusDown,        ///< the network interface went down, or the controller is off the bus
  kHeartbeatLost,  ///< a drive on a bus went silent
  kTorqueOff,      ///< safe torque off (STO) of a drive, or its voltage is not there
  kDisabled,       ///< a drive left, or does not reach, 'operation enabled' without a command
  kTargetIgnored,  ///< a drive reports that it does not follow its set-points
  kTooSlow,        ///< the device takes fewer frames than it announced, for long
  kCountChanged,   ///< since its restart a drive counts differently: its angles are not the joint's
  kThreadStill,    ///< corbot's thread for the device has stalled: a call to the device does not return
  kNoSetpoint,     ///< corbot's cycle has stalled: the device gets no set-point
};

/// Real-time safe. Returns the number that snapshots, records and alarms hold.
[[nodiscard]] constexpr std::uint32_t to_number(DeviceCause cause) noexcept {
  return static_cast<std::uint32_t>(cause);
}

/// Real-time safe. Returns the cause with this number; kNone if there is none. The switch has no default: the
/// compiler finds a cause that is missing here.
[[nodiscard]] constexpr DeviceCause to_device_cause(std::uint32_t number) noexcept {
  const auto cause = static_cast<DeviceCause>(number);
  switch (cause) {
    case DeviceCause::kNone:
    case DeviceCause::kNotThere:
    case DeviceCause::kInUse:
    case DeviceCause::kHungUp:
    case DeviceCause::kWriteTimeout:
    case DeviceCause::kNoAnswer:
    case DeviceCause::kBadAnswer:
    case DeviceCause::kDeviceFault:
    case DeviceCause::kBusDown:
    case DeviceCause::kHeartbeatLost:
    case DeviceCause::kTorqueOff:
    case DeviceCause::kDisabled:
    case DeviceCause::kTargetIgnored:
    case DeviceCause::kTooSlow:
    case DeviceCause::kCountChanged:
    case DeviceCause::kThreadStill:
    case DeviceCause::kNoSetpoint:
      return cause;
  }
  return DeviceCause::kNone;
}

}  // namespace corbot
