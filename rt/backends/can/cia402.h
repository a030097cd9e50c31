// SPDX-License-Identifier: Apache-2.0
// Frames and states of a drive after CiA 301 and CiA 402: pure functions.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <string>

#include "rt/backends/can/can_port.h"
#include "rt/backends/can/canopen.h"

namespace corbot::rt {

enum class NmtCommand : std::uint8_t { kStart = 0x01, kStop = 0x02, kPreOperational = 0x80 };

/// corbot's own node number, from which drives await a heartbeat.
inline constexpr std::uint8_t kMasterNode = 127;

/// The first objects of the communication parameters of PDOs (CiA 301).
inline constexpr std::uint16_t kRpdoParameters = 0x1400;
inline constexpr std::uint16_t kTpdoParameters = 0x1800;

/// The states in a heartbeat.
enum class NmtState : std::uint8_t { kBootUp = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

/// The drive's state (CiA 402, 8.4), from its statusword (6041h).
enum class DriveState {
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
  kUnknown,  ///< bits that no state has
};

inline constexpr std::uint16_t kDisableVoltage = 0x0000;
inline constexpr std::uint16_t kQuickStop = 0x0002;
inline constexpr std::uint16_t kShutDown = 0x0006;
inline constexpr std::uint16_t kSwitchOn = 0x0007;
inline constexpr std::uint16_t kEnableOperation = 0x000F;
inline constexpr std::uint16_t kStartHoming = 0x001F;  ///< in homing mode, enabled
inline constexpr std::uint16_t kHalt = 0x0100;         ///< in homing mode, added to the word
inline constexpr std::uint16_t kFaultReset = 0x0080;
inline constexpr std::uint16_t kStatusVoltage = 0x0010;
inline constexpr std::uint16_t kStatusWarning = 0x0080;
inline constexpr std::uint16_t kStatusInternalLimit = 0x0800;
/// Set in cyclic synchronous position mode if the drive follows its target position.
inline constexpr std::uint16_t kStatusFollows = 0x1000;
/// The bits of homing mode.
inline constexpr std::uint16_t kStatusReached = 0x0400;
inline constexpr std::uint16_t kStatusAttained = 0x1000;
inline constexpr std::uint16_t kStatusHomingError = 0x2000;

/// The modes of 6060h.
inline constexpr std::uint8_t kHoming = 6;
inline constexpr std::uint8_t kCyclicSynchronousPosition = 8;

/// The EMCY code of safe torque off.
inline constexpr std::uint16_t kTorqueOffCode = 0x5441;

/// The process data that a drive sends at each SYNC.
struct DriveProcessData {
  std::uint16_t statusword;
  std::int32_t position;
};

/// An emergency message, CiA 301, 7.2.7.
struct Emergency {
  std::uint16_t code;
  std::uint8_t error_register;
};

[[nodiscard]] CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept;
[[nodiscard]] CanFrame sync_frame() noexcept;
/// Returns corbot's heartbeat: it is operational.
[[nodiscard]] CanFrame master_heartbeat_frame() noexcept;
/// Returns controlword (6040h) and target position (607Ah), in counts.
[[nodiscard]] CanFrame rpdo_frame(std::uint8_t node, std::uint16_t controlword, std::int32_t target) noexcept;

/// Returns nothing if the frame has another length.
[[nodiscard]] std::optional<DriveProcessData> process_data_of(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<Emergency> emergency_of(const CanFrame& frame) noexcept;
/// Returns the state; a toggle bit is ignored.
[[nodiscard]] std::optional<NmtState> heartbeat_of(const CanFrame& frame) noexcept;

[[nodiscard]] DriveState state_of(std::uint16_t statusword) noexcept;
/// Tells whether the motor has torque in this state.
[[nodiscard]] bool is_powered(DriveState state) noexcept;
/// Returns the next controlword on the way to 'operation enabled'. `last`: the previous word; a fault is
/// reset by an edge.
[[nodiscard]] std::uint16_t controlword_towards_operation(DriveState state, std::uint16_t last) noexcept;
[[nodiscard]] const char* to_string(DriveState state) noexcept;
[[nodiscard]] const char* to_string(NmtState state) noexcept;

/// Tells whether an emergency means that the drive cannot go on. Emergencies of the communication, except a
/// lost heartbeat, are warnings as long as the statusword agrees. So are those that the maker defines without
/// a fault.
[[nodiscard]] bool is_fault(std::uint16_t emergency_code) noexcept;
/// Returns "EMCY 0x3210 (DC link over-voltage)": CiA 301, table 26, and CiA 402, table 'error codes'.
[[nodiscard]] std::string describe_emergency(std::uint16_t code);

/// The interpolation time of 60C2h as value * 10^exponent seconds; empty if no such pair is exact.
struct InterpolationTime {
  std::uint8_t value;
  std::int8_t exponent;
};
[[nodiscard]] std::optional<InterpolationTime> interpolation_time(std::int64_t period_ns) noexcept;

/// Converts to counts, rounded and clamped to 32 bits. A value that is not a number gives `otherwise`.
[[nodiscard]] std::int32_t to_counts(double counts, std::int32_t otherwise) noexcept;

}  // namespace corbot::rt
