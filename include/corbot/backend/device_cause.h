// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// Why a device is degraded, lost, or cannot be opened. Its number is what the snapshot, the alarm and the
/// client get; docs/alarms.md lists them.
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
  kDisabled,       ///< a drive left 'operation enabled' although nobody asked for it, or is not brought there
  kTargetIgnored,  ///< a drive does not follow its set-points, and says so
  kTooSlow,        ///< takes fewer frames than it announced, for long
  kCountChanged,   ///< a drive counts otherwise than before its restart: its angles are not the joint's
  kThreadStill,    ///< corbot's thread that serves it stands still: a call to it does not return
  kNoSetpoint,     ///< corbot's cycle stands still: no set-point comes for it
};

/// Real-time safe. The number as it stands in a snapshot, a record or an alarm.
[[nodiscard]] constexpr std::uint32_t to_number(DeviceCause cause) noexcept {
  return static_cast<std::uint32_t>(cause);
}

/// Real-time safe. The cause that such a number stands for; kNone for a number that stands for none. A switch
/// without default: the compiler finds a cause that is missing here.
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
