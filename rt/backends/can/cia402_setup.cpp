// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/cia402_setup.h"

#include <array>

#include "rt/backends/can/cia402.h"
#include "rt/backends/can/drive_objects.h"

namespace corbot::rt {
namespace {

constexpr ObjectAddress kDeviceType{0x1000};
constexpr ObjectAddress kSyncIdentifier{0x1005};
constexpr ObjectAddress kSyncPeriod{0x1006};
constexpr ObjectAddress kDeviceName{0x1008};
constexpr ObjectAddress kConsumerHeartbeat{0x1016, 1};
constexpr ObjectAddress kProducerHeartbeat{0x1017};
constexpr std::uint16_t kIdentity = 0x1018;
constexpr ObjectAddress kErrorCode{0x603F};
constexpr ObjectAddress kPosition{0x6064};
constexpr ObjectAddress kFollowingWindow{0x6065};
constexpr ObjectAddress kTarget{0x607A};
constexpr ObjectAddress kInterpolationValue{0x60C2, 1};
constexpr ObjectAddress kInterpolationExponent{0x60C2, 2};
constexpr ObjectAddress kSupportedModes{0x6502};

constexpr std::uint32_t kProfile402 = 402;
constexpr std::uint32_t kCyclicPositionBit = 1u << 7;

constexpr std::uint16_t kRpdoMapping = 0x1600;
constexpr std::uint16_t kTpdoMapping = 0x1A00;

/// Index, sub-index and bits of an object in a PDO.
constexpr std::uint32_t kControlword = 0x6040'0010;
constexpr std::uint32_t kTargetPosition = 0x607A'0020;
constexpr std::uint32_t kStatusword = 0x6041'0010;
constexpr std::uint32_t kActualPosition = 0x6064'0020;

void set_up_sync(DriveObjects& objects, const DriveSetup& setup) {
  constexpr std::uint32_t kProducesAndIdentifier = 0x4000'07FF;
  if (objects.sdo().read_if_there(kSyncIdentifier)) {
    objects.ensure(kSyncIdentifier, kSync, 4, kProducesAndIdentifier);
  }
  const auto period_us = static_cast<std::uint32_t>(setup.period_ns / 1000);
  // A period of 0 means that the drive does not use it, and it need not be writable then.
  if (const auto period = objects.sdo().read_if_there(kSyncPeriod); period && *period != period_us) {
    const auto abort_code =
        *period == 0 ? objects.sdo().try_to_write(kSyncPeriod, period_us, 4) : std::nullopt;
    constexpr std::uint32_t kReadOnly = 0x0601'0002;
    if (abort_code != kReadOnly) objects.ensure(kSyncPeriod, period_us, 4);
  }
}

/// Checks mode and heartbeat. They are rarely stored: a restart, whose boot-up message may have been missed,
/// resets them.
bool is_set_up(DriveObjects& objects, const DriveSetup& setup) {
  return objects.mode() == kCyclicSynchronousPosition &&
         objects.sdo().read(kProducerHeartbeat) == static_cast<std::uint32_t>(setup.heartbeat_ms);
}

void check_identity(SdoClient& sdo, const DriveIdentity& identity) {
  static constexpr std::array<const char*, 4> kNames{"vendor", "product", "revision", "serial"};
  for (std::size_t i = 0; i < identity.size(); ++i) {
    if (!identity[i]) continue;
    const ObjectAddress object{kIdentity, static_cast<std::uint8_t>(i + 1)};
    const auto has = sdo.read_if_there(object);
    if (has == identity[i]) continue;
    sdo.fail(DeviceCause::kBadAnswer, "is another drive: its " + std::string(kNames[i]) + " (" +
                                          to_string(object) + ") is " + (has ? hex(*has, 8) : "not there") +
                                          ", the profile has " + hex(*identity[i], 8));
  }
}

}  // namespace

bool is_homed(CanPort& port, DriveWatch& watch, std::uint8_t node) {
  DriveObjects objects(port, watch, node);
  objects.set_mode(kHoming);  // without its start bit nothing moves, and a holding drive goes on holding
  return (objects.statusword() & kStatusAttained) != 0;
}

DriveFound set_up_drive(CanPort& port, DriveWatch& watch, const DriveSetup& setup) {
  DriveObjects objects(port, watch, setup.node);
  SdoClient& sdo = objects.sdo();
  const std::uint32_t type = sdo.read(kDeviceType);
  if ((type & 0xFFFF) != kProfile402) {
    sdo.fail(DeviceCause::kBadAnswer,
             "is no drive after CiA 402: its device type (1000h) is " + hex(type, 8));
  }
  check_identity(sdo, setup.identity);
  const auto modes = sdo.read_if_there(kSupportedModes);
  if (modes && (*modes & kCyclicPositionBit) == 0) {
    sdo.fail(DeviceCause::kBadAnswer,
             "does not support cyclic synchronous position mode (6502h is " + hex(*modes, 8) + ")");
  }
  DriveFound found{sdo.read_text(kDeviceName), is_set_up(objects, setup)};
  if (setup.is_gripper) found.following_window = sdo.read_if_there(kFollowingWindow);
  objects.switch_off_other_pdos();
  set_up_sync(objects, setup);
  if (const auto time = interpolation_time(setup.period_ns)) {
    objects.ensure(kInterpolationValue, time->value, 1);
    objects.ensure(kInterpolationExponent, static_cast<std::uint8_t>(time->exponent), 1);
  }
  objects.ensure(kProducerHeartbeat, static_cast<std::uint32_t>(setup.heartbeat_ms), 2);
  static constexpr std::array<std::uint32_t, 2> kReceived{kControlword, kTargetPosition};
  static constexpr std::array<std::uint32_t, 2> kSent{kStatusword, kActualPosition};
  objects.ensure_pdo({kRpdoParameters, kRpdoMapping, kRpdo1 + setup.node, kReceived});
  objects.ensure_pdo({kTpdoParameters, kTpdoMapping, kTpdo1 + setup.node, kSent});
  if (!setup.home_command.empty() && !is_homed(port, watch, setup.node)) {
    sdo.fail(DeviceCause::kDeviceFault,
             "has not been homed since its power-up, so the position of its joint is unknown: type '" +
                 setup.home_command + "'");
  }
  // The drive stays at its held position, whatever its last target was.
  if (objects.mode() != kCyclicSynchronousPosition &&
      state_of(objects.statusword()) == DriveState::kOperationEnabled) {
    sdo.write(kTarget, sdo.read(kPosition), 4);
  }
  objects.set_mode(kCyclicSynchronousPosition);
  return found;
}

void watch_master(CanPort& port, DriveWatch& watch, std::uint8_t node, int watch_ms) {
  SdoClient sdo(port, watch, node);
  if (!sdo.read_if_there(kConsumerHeartbeat)) {
    sdo.fail(DeviceCause::kBadAnswer, "cannot await a heartbeat (no 1016h:1): set watch_ms = 0");
  }
  const auto time = static_cast<std::uint32_t>(watch_ms);
  DriveObjects(port, watch, node)
      .ensure(kConsumerHeartbeat, watch_ms == 0 ? 0 : std::uint32_t{kMasterNode} << 16 | time, 4);
}

std::uint16_t read_error_code(CanPort& port, DriveWatch& watch, std::uint8_t node) noexcept {
  try {
    return static_cast<std::uint16_t>(SdoClient(port, watch, node).read_if_there(kErrorCode).value_or(0));
  } catch (const DeviceError&) {
    return 0;  // no error code
  }
}

}  // namespace corbot::rt
