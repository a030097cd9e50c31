// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/cia402_setup.h"

#include <array>
#include <span>

#include "corbot/running_time.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = CanPort::Clock;

constexpr ObjectAddress kDeviceType{0x1000};
constexpr ObjectAddress kSyncIdentifier{0x1005};
constexpr ObjectAddress kSyncPeriod{0x1006};
constexpr ObjectAddress kDeviceName{0x1008};
constexpr ObjectAddress kConsumerHeartbeat{0x1016, 1};
constexpr ObjectAddress kProducerHeartbeat{0x1017};
constexpr ObjectAddress kErrorCode{0x603F};
constexpr ObjectAddress kMode{0x6060};
constexpr ObjectAddress kModeDisplay{0x6061};
constexpr ObjectAddress kInterpolationValue{0x60C2, 1};
constexpr ObjectAddress kInterpolationExponent{0x60C2, 2};
constexpr ObjectAddress kSupportedModes{0x6502};

constexpr std::uint32_t kProfile402 = 402;
constexpr std::uint32_t kCyclicSynchronousPosition = 8;
constexpr std::uint32_t kCyclicPositionBit = 1u << 7;
constexpr std::uint32_t kPdoOff = 1u << 31;
constexpr std::uint32_t kNoRemoteRequest = 1u << 30;
constexpr std::uint32_t kEverySync = 1;
constexpr auto kModeWithin = 1s;

constexpr std::uint16_t kRpdoParameters = 0x1400;
constexpr std::uint16_t kRpdoMapping = 0x1600;
constexpr std::uint16_t kTpdoParameters = 0x1800;
constexpr std::uint16_t kTpdoMapping = 0x1A00;

/// Index, sub-index and bits of an object in a PDO.
constexpr std::uint32_t kControlword = 0x6040'0010;
constexpr std::uint32_t kTargetPosition = 0x607A'0020;
constexpr std::uint32_t kStatusword = 0x6041'0010;
constexpr std::uint32_t kActualPosition = 0x6064'0020;

/// CiA 301, 7.5.2.36: off, no entries, the entries, their number, on.
void set_up_pdo(SdoClient& sdo, std::uint16_t parameters, std::uint16_t mapping, canid_t identifier,
                std::span<const std::uint32_t> entries) {
  const bool sends = parameters == kTpdoParameters;
  const std::uint32_t off = kPdoOff | (sends ? kNoRemoteRequest : 0u) | identifier;
  const std::uint32_t mask = ~kNoRemoteRequest;  // which some devices keep, and some do not
  sdo.write_checked({parameters, 1}, off, 4, mask);
  sdo.write_checked({mapping, 0}, 0, 1);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    sdo.write_checked({mapping, static_cast<std::uint8_t>(i + 1)}, entries[i], 4);
  }
  sdo.write_checked({parameters, 2}, kEverySync, 1);
  sdo.write_checked({mapping, 0}, static_cast<std::uint32_t>(entries.size()), 1);
  sdo.write_checked({parameters, 1}, off & ~kPdoOff, 4, mask);
}

/// What the drive would send of its own accord takes the bus from those that are waited for.
void switch_off_other_pdos(SdoClient& sdo) {
  for (std::uint16_t number = 1; number < 4; ++number) {
    const ObjectAddress object{static_cast<std::uint16_t>(kTpdoParameters + number), 1};
    const auto identifier = sdo.read_if_there(object);
    if (identifier && (*identifier & kPdoOff) == 0) sdo.write_checked(object, *identifier | kPdoOff, 4);
  }
}

void set_up_sync(SdoClient& sdo, const DriveSetup& setup) {
  constexpr std::uint32_t kProducesAndIdentifier = 0x4000'07FF;
  const auto identifier = sdo.read_if_there(kSyncIdentifier);
  if (identifier && (*identifier & kProducesAndIdentifier) != kSync) {
    sdo.write_checked(kSyncIdentifier, kSync, 4, kProducesAndIdentifier);
  }
  const auto period_us = static_cast<std::uint32_t>(setup.period_ns / 1000);
  if (const auto period = sdo.read_if_there(kSyncPeriod); period && *period != period_us) {
    sdo.write_checked(kSyncPeriod, period_us, 4);
  }
}

void set_mode(SdoClient& sdo) {
  sdo.write(kMode, kCyclicSynchronousPosition, 1);
  RunningTime waited(kModeWithin / 5, Clock::now());
  for (;;) {
    const std::uint32_t mode = sdo.read(kModeDisplay) & 0xFF;
    if (mode == kCyclicSynchronousPosition) return;
    if (waited.look(Clock::now()) >= kModeWithin) {
      sdo.fail(DeviceCause::kBadAnswer,
               "stays in mode " + std::to_string(mode) + " (6061h), not 8, cyclic synchronous position");
    }
  }
}

/// Mode and heartbeat are rarely stored: a restart, whose boot-up message may have been missed, resets them.
bool is_set_up(SdoClient& sdo, const DriveSetup& setup) {
  return (sdo.read(kModeDisplay) & 0xFF) == kCyclicSynchronousPosition &&
         sdo.read(kProducerHeartbeat) == static_cast<std::uint32_t>(setup.heartbeat_ms);
}

}  // namespace

DriveFound set_up_drive(CanPort& port, DriveWatch& watch, const DriveSetup& setup) {
  SdoClient sdo(port, watch, setup.node);
  const std::uint32_t type = sdo.read(kDeviceType);
  if ((type & 0xFFFF) != kProfile402) {
    sdo.fail(DeviceCause::kBadAnswer,
             "is no drive after CiA 402: its device type (1000h) is " + hex(type, 8));
  }
  const auto modes = sdo.read_if_there(kSupportedModes);
  if (modes && (*modes & kCyclicPositionBit) == 0) {
    sdo.fail(DeviceCause::kBadAnswer,
             "does not support cyclic synchronous position mode (6502h is " + hex(*modes, 8) + ")");
  }
  DriveFound found{sdo.read_text(kDeviceName), is_set_up(sdo, setup)};
  switch_off_other_pdos(sdo);
  set_up_sync(sdo, setup);
  static constexpr std::array<std::uint32_t, 2> kReceived{kControlword, kTargetPosition};
  static constexpr std::array<std::uint32_t, 2> kSent{kStatusword, kActualPosition};
  set_up_pdo(sdo, kRpdoParameters, kRpdoMapping, kRpdo1 + setup.node, kReceived);
  set_up_pdo(sdo, kTpdoParameters, kTpdoMapping, kTpdo1 + setup.node, kSent);
  if (const auto time = interpolation_time(setup.period_ns)) {
    sdo.write_checked(kInterpolationValue, time->value, 1);
    sdo.write_checked(kInterpolationExponent, static_cast<std::uint8_t>(time->exponent), 1);
  }
  set_mode(sdo);
  sdo.write_checked(kProducerHeartbeat, static_cast<std::uint32_t>(setup.heartbeat_ms), 2);
  return found;
}

void watch_master(CanPort& port, DriveWatch& watch, std::uint8_t node, int watch_ms) {
  SdoClient sdo(port, watch, node);
  if (!sdo.read_if_there(kConsumerHeartbeat)) {
    sdo.fail(DeviceCause::kBadAnswer, "cannot await a heartbeat (no 1016h:1): set watch_ms = 0");
  }
  const auto time = static_cast<std::uint32_t>(watch_ms);
  sdo.write_checked(kConsumerHeartbeat, watch_ms == 0 ? 0 : std::uint32_t{kMasterNode} << 16 | time, 4);
}

std::uint16_t read_error_code(CanPort& port, DriveWatch& watch, std::uint8_t node) noexcept {
  try {
    return static_cast<std::uint16_t>(SdoClient(port, watch, node).read_if_there(kErrorCode).value_or(0));
  } catch (const DeviceError&) {
    return 0;  // no error code
  }
}

}  // namespace corbot::rt
