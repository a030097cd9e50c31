// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/backends/can/drive_settings.h"
#include "rt/backends/can/sdo_client.h"

namespace corbot::rt {

struct DriveSetup {
  std::uint8_t node;
  std::int64_t period_ns;  ///< of SYNC; one that interpolation_time() accepts
  int heartbeat_ms;
  DriveIdentity identity{};
  bool is_gripper{false};
  std::string home_command{};  ///< for a drive that must be homed after each power-up; else empty
};

struct DriveFound {
  std::string name;                                 ///< "": none
  bool was_set_up;                                  ///< by an earlier call, and has not restarted since
  std::optional<std::uint32_t> following_window{};  ///< 6065h of a gripper's drive, where it is there
};

/// Makes a drive that is pre-operational follow RPDO1 and answer by TPDO1 at every SYNC, in cyclic
/// synchronous position mode, and checks what it is. Reads first, and writes only what differs; everything that is written
/// is read again. Throws DeviceError.
DriveFound set_up_drive(CanPort& port, DriveWatch& watch, const DriveSetup& setup);

/// 1016h: from the first of corbot's heartbeats on, the drive reacts when none comes for so long; 0: not any
/// more. Throws DeviceError.
void watch_master(CanPort& port, DriveWatch& watch, std::uint8_t node, int watch_ms);

/// A drive that is homed keeps that until its power fails, and shows it in homing mode (statusword bit 12). One that holds
/// its load goes on holding. Leaves it in that mode.
[[nodiscard]] bool is_homed(CanPort& port, DriveWatch& watch, std::uint8_t node);

/// 603Fh, error code of a drive in fault; 0: none.
[[nodiscard]] std::uint16_t read_error_code(CanPort& port, DriveWatch& watch, std::uint8_t node) noexcept;

}  // namespace corbot::rt
