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
  std::int64_t period_ns;  ///< period of SYNC; interpolation_time() must accept it
  int heartbeat_ms;
  DriveIdentity identity{};
  bool is_gripper{false};
  std::string home_command{};  ///< for a drive that must be homed after each power-up; else empty
};

struct DriveFound {
  std::string name;                                 ///< "": none
  bool was_set_up;                                  ///< by an earlier call, and it has not restarted since
  std::optional<std::uint32_t> following_window{};  ///< 6065h of a gripper's drive, if it is there
};

/// Makes a pre-operational drive follow RPDO1 and answer by TPDO1 at every SYNC, in cyclic synchronous
/// position mode. It also checks the drive's identity. It reads first, writes only differences, and reads
/// back everything written. Throws DeviceError.
DriveFound set_up_drive(CanPort& port, DriveWatch& watch, const DriveSetup& setup);

/// Sets 1016h: from corbot's first heartbeat on, the drive reacts if none comes for this time; 0: it no
/// longer does. Throws DeviceError.
void watch_master(CanPort& port, DriveWatch& watch, std::uint8_t node, int watch_ms);

/// Tells whether the drive is homed. A homed drive remains so until its power fails, and shows it in homing
/// mode (statusword bit 12). A drive that holds its load goes on holding. The call leaves the drive in that
/// mode.
[[nodiscard]] bool is_homed(CanPort& port, DriveWatch& watch, std::uint8_t node);

/// Returns 603Fh, the error code of a drive in fault; 0: none.
[[nodiscard]] std::uint16_t read_error_code(CanPort& port, DriveWatch& watch, std::uint8_t node) noexcept;

}  // namespace corbot::rt
