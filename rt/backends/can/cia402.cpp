// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/cia402.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/backends/can/canopen_sdo.h"

namespace corbot::rt {
namespace {

constexpr std::uint8_t kProcessDataBytes = 6;
constexpr std::uint8_t kMostNodes = 127;

CanFrame frame_of(canid_t id, std::uint8_t length) noexcept {
  CanFrame frame{};
  frame.can_id = id;
  frame.can_dlc = length;
  return frame;
}

void put(CanFrame& frame, std::size_t offset, std::size_t bytes, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < bytes; ++i)
    frame.data[offset + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

}  // namespace

CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept {
  CanFrame frame = frame_of(kNmt, 2);
  frame.data[0] = static_cast<std::uint8_t>(command);
  frame.data[1] = node;
  return frame;
}

CanFrame sync_frame() noexcept { return frame_of(kSync, 0); }

CanFrame master_heartbeat_frame() noexcept {
  CanFrame frame = frame_of(kHeartbeat + kMasterNode, 1);
  frame.data[0] = static_cast<std::uint8_t>(NmtState::kOperational);
  return frame;
}

CanFrame rpdo_frame(std::uint8_t node, std::uint16_t controlword, std::int32_t target) noexcept {
  CanFrame frame = frame_of(kRpdo1 + node, kProcessDataBytes);
  put(frame, 0, 2, controlword);
  put(frame, 2, 4, static_cast<std::uint32_t>(target));
  return frame;
}

std::optional<DriveProcessData> process_data_of(const CanFrame& frame) noexcept {
  if (frame.can_dlc != kProcessDataBytes) return std::nullopt;
  return DriveProcessData{static_cast<std::uint16_t>(little_endian(frame, 0, 2)),
                          static_cast<std::int32_t>(little_endian(frame, 2, 4))};
}

std::optional<Emergency> emergency_of(const CanFrame& frame) noexcept {
  if (frame.can_dlc != CAN_MAX_DLEN) return std::nullopt;
  return Emergency{static_cast<std::uint16_t>(little_endian(frame, 0, 2)), frame.data[2]};
}

std::optional<NmtState> heartbeat_of(const CanFrame& frame) noexcept {
  if (frame.can_dlc != 1) return std::nullopt;
  const auto state = static_cast<std::uint8_t>(frame.data[0] & kMostNodes);
  for (const NmtState known :
       {NmtState::kBootUp, NmtState::kStopped, NmtState::kOperational, NmtState::kPreOperational}) {
    if (state == static_cast<std::uint8_t>(known)) return known;
  }
  return std::nullopt;
}

DriveState state_of(std::uint16_t statusword) noexcept {
  struct Pattern {
    std::uint16_t mask;
    std::uint16_t bits;
    DriveState state;
  };
  static constexpr std::array<Pattern, 8> kPatterns{{{0x4F, 0x00, DriveState::kNotReadyToSwitchOn},
                                                     {0x4F, 0x40, DriveState::kSwitchOnDisabled},
                                                     {0x6F, 0x21, DriveState::kReadyToSwitchOn},
                                                     {0x6F, 0x23, DriveState::kSwitchedOn},
                                                     {0x6F, 0x27, DriveState::kOperationEnabled},
                                                     {0x6F, 0x07, DriveState::kQuickStopActive},
                                                     {0x4F, 0x0F, DriveState::kFaultReactionActive},
                                                     {0x4F, 0x08, DriveState::kFault}}};
  for (const Pattern& pattern : kPatterns) {
    if ((statusword & pattern.mask) == pattern.bits) return pattern.state;
  }
  return DriveState::kUnknown;
}

bool is_powered(DriveState state) noexcept {
  return state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive ||
         state == DriveState::kFaultReactionActive;
}

std::uint16_t controlword_towards_operation(DriveState state, std::uint16_t last) noexcept {
  switch (state) {
    case DriveState::kSwitchOnDisabled:
      return kShutDown;
    case DriveState::kReadyToSwitchOn:
      return kSwitchOn;
    case DriveState::kSwitchedOn:
    case DriveState::kOperationEnabled:
      return kEnableOperation;
    case DriveState::kFault:
      return (last & kFaultReset) != 0 ? kDisableVoltage : kFaultReset;
    default:
      return kDisableVoltage;
  }
}

const char* to_string(DriveState state) noexcept {
  switch (state) {
    case DriveState::kNotReadyToSwitchOn:
      return "not ready to switch on";
    case DriveState::kSwitchOnDisabled:
      return "switch on disabled";
    case DriveState::kReadyToSwitchOn:
      return "ready to switch on";
    case DriveState::kSwitchedOn:
      return "switched on";
    case DriveState::kOperationEnabled:
      return "operation enabled";
    case DriveState::kQuickStopActive:
      return "quick stop active";
    case DriveState::kFaultReactionActive:
      return "fault reaction active";
    case DriveState::kFault:
      return "fault";
    default:
      return "in no state of CiA 402";
  }
}

const char* to_string(NmtState state) noexcept {
  switch (state) {
    case NmtState::kBootUp:
      return "booting";
    case NmtState::kStopped:
      return "stopped";
    case NmtState::kOperational:
      return "operational";
    default:
      return "pre-operational";
  }
}

bool is_fault(std::uint16_t code) noexcept {
  constexpr std::uint16_t kHeartbeatError = 0x8130;
  if (code == 0 || code == kHeartbeatError) return code != 0;
  const auto group = static_cast<unsigned>(code >> 8);
  return group != 0x81 && group != 0x82 && group != 0xFF;
}

std::string describe_emergency(std::uint16_t code) {
  struct Words {
    std::uint16_t code;
    std::uint16_t mask;
    const char* text;
  };
  // The first match counts: single codes precede their group.
  static constexpr std::array<Words, 44> kWords{
      {{0x0000, 0xFFFF, "error reset or no error"},
       {0x2220, 0xFFFF, "continuous over-current in the device"},
       {0x2230, 0xFFFF, "short circuit or earth leakage in the device"},
       {0x2310, 0xFFFF, "continuous over-current at the motor"},
       {0x2320, 0xFFFF, "short circuit or earth leakage at the motor"},
       {0x2340, 0xFFFF, "short circuit at the motor"},
       {0x3110, 0xFFFF, "mains over-voltage"},
       {0x3120, 0xFFFF, "mains under-voltage"},
       {0x3130, 0xFFFF, "phase failure"},
       {0x3210, 0xFFFF, "DC link over-voltage"},
       {0x3220, 0xFFFF, "DC link under-voltage"},
       {0x4210, 0xFFFF, "device too hot"},
       {0x4310, 0xFFFF, "drive too hot"},
       {0x5112, 0xFFFF, "control supply under-voltage"},
       {0x5441, 0xFFFF, "safe torque off, or contact 1"},
       {0x6320, 0xFFFF, "parameter error"},
       {0x7120, 0xFFFF, "motor"},
       {0x7121, 0xFFFF, "motor blocked"},
       {0x7300, 0xFF00, "sensor"},
       {0x7500, 0xFF00, "communication inside the device"},
       {0x8110, 0xFFFF, "CAN overrun, objects lost"},
       {0x8120, 0xFFFF, "CAN in error passive mode"},
       {0x8130, 0xFFFF, "life guard or heartbeat error"},
       {0x8140, 0xFFFF, "recovered from bus off"},
       {0x8150, 0xFFFF, "CAN identifier collision"},
       {0x8210, 0xFFFF, "PDO not processed: wrong length"},
       {0x8220, 0xFFFF, "PDO too long"},
       {0x8240, 0xFFFF, "unexpected SYNC data length"},
       {0x8250, 0xFFFF, "RPDO timeout"},
       {0x8400, 0xFF00, "velocity controller"},
       {0x8500, 0xFF00, "position controller"},
       {0x8600, 0xFFFF, "positioning controller"},
       {0x8611, 0xFFFF, "following error"},
       {0x8612, 0xFFFF, "reference limit"},
       {0x1000, 0xFF00, "generic error"},
       {0x2000, 0xF000, "current"},
       {0x3000, 0xF000, "voltage"},
       {0x4000, 0xF000, "temperature"},
       {0x5000, 0xF000, "device hardware"},
       {0x6000, 0xF000, "device software"},
       {0x7000, 0xF000, "additional modules"},
       {0x8100, 0xFF00, "communication"},
       {0x8000, 0xF000, "monitoring"},
       {0xFF00, 0xFF00, "specific to the device, see its manual"}}};
  const auto* const found =
      std::find_if(kWords.begin(), kWords.end(), [&](const Words& w) { return (code & w.mask) == w.code; });
  return "EMCY " + hex(code, 4) + " (" + (found == kWords.end() ? "unknown" : found->text) + ")";
}

std::optional<InterpolationTime> interpolation_time(std::int64_t period_ns) noexcept {
  if (period_ns <= 0) return std::nullopt;
  std::int64_t unit_ns = 1'000'000;  // milliseconds if possible: some drives accept nothing else
  for (int exponent = -3; exponent >= -9; --exponent, unit_ns /= 10) {
    if (period_ns % unit_ns != 0) continue;
    const std::int64_t value = period_ns / unit_ns;
    if (value > std::numeric_limits<std::uint8_t>::max()) return std::nullopt;
    return InterpolationTime{static_cast<std::uint8_t>(value), static_cast<std::int8_t>(exponent)};
  }
  return std::nullopt;
}

std::int32_t to_counts(double counts, std::int32_t otherwise) noexcept {
  if (std::isnan(counts)) return otherwise;
  constexpr double kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(std::round(counts), kLowest, kHighest));
}

}  // namespace corbot::rt
