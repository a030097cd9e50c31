// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_watch.h"

#include <linux/can/error.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace corbot::rt {
namespace {

constexpr std::uint8_t kNoNode = 0x7F;
/// The interface reports that it could not send, but not that it can again.
constexpr auto kTxTimeoutStands = std::chrono::seconds(1);
/// A drive may drop a target now and then.
constexpr int kMostIgnored = 10;
constexpr unsigned kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;

std::string with_emergency(const DriveReport& drive) {
  return drive.emergency == 0 ? "" : ": " + describe_emergency(drive.emergency);
}

bool is_off(std::uint16_t statusword) {
  const DriveState state = state_of(statusword);
  return state == DriveState::kSwitchOnDisabled || state == DriveState::kReadyToSwitchOn;
}

}  // namespace

std::string name_of(const DriveReport& drive) { return "node " + std::to_string(drive.node); }

DriveWatch::DriveWatch(const std::vector<std::uint8_t>& nodes) {
  for (const std::uint8_t node : nodes) drives_.push_back({node});
  reports_following_.assign(drives_.size(), true);
  may_press_.assign(drives_.size(), false);
  shows_voltage_.assign(drives_.size(), false);
}

void DriveWatch::clear(Time now) {
  for (DriveReport& drive : drives_) {
    drive = DriveReport{drive.node};
    drive.heartbeat = drive.process_time = now;
  }
  is_bus_off_ = is_error_passive_ = false;
  tx_timeout_.reset();
  invalid_frame_.clear();
}

void DriveWatch::settle_faults() {
  for (DriveReport& drive : drives_) {
    if (is_fault(drive.emergency)) drive.emergency = 0;
  }
  invalid_frame_.clear();
}

void DriveWatch::forgive(Time now) {
  for (DriveReport& drive : drives_) {
    drive.heartbeat = now;
    if (drive.awaited_since) drive.awaited_since = now;
  }
}

void DriveWatch::expect_answers(Time now) {
  for (DriveReport& drive : drives_) {
    if (!drive.awaited_since) drive.awaited_since = now;
  }
}

bool DriveWatch::has_all_answers() const {
  return std::none_of(drives_.begin(), drives_.end(),
                      [](const DriveReport& drive) { return drive.awaited_since.has_value(); });
}

void DriveWatch::take(const CanFrame& frame, Time now) {
  if ((frame.can_id & CAN_ERR_FLAG) != 0) return take_error(frame, now);
  if ((frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0 || frame.can_dlc > CAN_MAX_DLEN) return;
  const canid_t function = frame.can_id & ~canid_t{kNoNode};
  const auto node = static_cast<std::uint8_t>(frame.can_id & kNoNode);
  const auto found =
      std::find_if(drives_.begin(), drives_.end(), [&](const DriveReport& d) { return d.node == node; });
  if (found == drives_.end()) return;
  DriveReport& drive = *found;
  if (function == kTpdo1) {
    take_process(drive, frame, now);
  } else if (function == kHeartbeat) {
    const auto state = heartbeat_of(frame);
    if (!state) {
      invalid_frame_ = name_of(drive) + " sends an invalid heartbeat";
      return;
    }
    drive.has_restarted |= *state == NmtState::kBootUp;
    drive.has_heartbeat = true;
    drive.nmt = *state;
    drive.heartbeat = now;
  } else if (function == kEmergency) {
    if (const auto emergency = emergency_of(frame)) {
      drive.emergency = emergency->code;
    } else {
      invalid_frame_ = name_of(drive) + " sends an emergency of a wrong length";
    }
  }
}

void DriveWatch::take_process(DriveReport& drive, const CanFrame& frame, Time now) {
  const auto process = process_data_of(frame);
  if (!process || state_of(process->statusword) == DriveState::kUnknown) {
    invalid_frame_ = name_of(drive) + " sends invalid process data";
    return;
  }
  if (drive.has_process) {
    const std::int64_t leap = std::abs(std::int64_t{process->position} - drive.process.position);
    if (leap > drive.leap) drive.leap_time = now - drive.process_time;
    drive.leap = std::max(drive.leap, leap);
  }
  drive.process = *process;
  if (is_off(process->statusword) && (process->statusword & kStatusVoltage) != 0)
    shows_voltage_[static_cast<std::size_t>(&drive - drives_.data())] = true;
  if (state_of(process->statusword) == DriveState::kOperationEnabled) {
    drive.had_voltage = (process->statusword & kStatusVoltage) != 0;
    drive.ignored = (process->statusword & kStatusFollows) != 0 ? 0 : drive.ignored + 1;
  } else {
    drive.ignored = 0;
  }
  drive.has_process = true;
  drive.awaited_since.reset();
  drive.process_time = now;
}

void DriveWatch::take_error(const CanFrame& frame, Time now) {
  const unsigned controller = frame.can_dlc > 1 ? frame.data[1] : 0u;
  is_bus_off_ |= (frame.can_id & CAN_ERR_BUSOFF) != 0;
  if ((frame.can_id & CAN_ERR_TX_TIMEOUT) != 0) tx_timeout_ = now;
  if ((frame.can_id & CAN_ERR_CRTL) != 0) {
    if ((controller & kPassive) != 0) is_error_passive_ = true;
    if ((controller & CAN_ERR_CRTL_ACTIVE) != 0) is_error_passive_ = false;
  }
  if ((frame.can_id & CAN_ERR_RESTARTED) == 0) return;
  is_error_passive_ = false;
  tx_timeout_.reset();
}

void DriveWatch::check_bus() const {
  if (!is_bus_off_) return;
  throw DeviceError(DeviceCause::kBusDown,
                    "bus off: too many errors; look at wiring, termination and bit rate");
}

void DriveWatch::check_enabled(const DriveReport& drive, bool reports_following) const {
  const std::uint16_t word = drive.process.statusword;
  const DriveState state = state_of(word);
  const bool is_off = drive.has_process && state != DriveState::kOperationEnabled;
  const auto now = [&] { return name_of(drive) + ", now '" + to_string(state) + "', "; };
  if (drive.emergency == kTorqueOffCode || (is_off && drive.had_voltage && (word & kStatusVoltage) == 0)) {
    throw DeviceError(DeviceCause::kTorqueOff,
                      now() + "has safe torque off, or no voltage" + with_emergency(drive));
  }
  const bool is_faulty = state == DriveState::kFault || state == DriveState::kFaultReactionActive;
  if (is_fault(drive.emergency) || (is_off && is_faulty)) {
    throw DeviceError(DeviceCause::kDeviceFault, now() + "has a fault" + with_emergency(drive));
  }
  if (is_off) {
    throw DeviceError(DeviceCause::kDisabled,
                      now() + "has left 'operation enabled' without a command" + with_emergency(drive));
  }
  if (reports_following && drive.ignored > kMostIgnored) {
    throw DeviceError(DeviceCause::kTargetIgnored,
                      name_of(drive) + " does not follow its target positions (statusword bit 12 is 0)");
  }
}

void DriveWatch::check_off(const DriveReport& drive, bool shows_voltage) {
  if (!shows_voltage || !drive.has_process || !is_off(drive.process.statusword) ||
      (drive.process.statusword & kStatusVoltage) != 0)
    return;
  throw DeviceError(DeviceCause::kTorqueOff,
                    name_of(drive) + " has safe torque off, or no voltage" + with_emergency(drive));
}

void DriveWatch::check(Time now, Duration heartbeat, Duration process, bool enabled) {
  check_bus();
  for (const DriveReport& drive : drives_) {
    if (drive.has_restarted) {
      throw DeviceError(DeviceCause::kDeviceFault, name_of(drive) +
                                                       " has restarted: check its power supply; corbot uses "
                                                       "the drive again if its count is unchanged");
    }
    // The drive's own report comes first: a drive with a fault may fall silent after it.
    const auto index = static_cast<std::size_t>(&drive - drives_.data());
    if (enabled) check_enabled(drive, reports_following_[index]);
    if (!enabled) check_off(drive, shows_voltage_[index]);
    if (drive.has_heartbeat && drive.nmt != NmtState::kOperational) {
      throw DeviceError(DeviceCause::kDeviceFault, name_of(drive) + " has become " + to_string(drive.nmt));
    }
    if (now - drive.heartbeat > heartbeat) {
      throw DeviceError(DeviceCause::kHeartbeatLost,
                        name_of(drive) + ": no heartbeat: is it powered, is the cable whole?");
    }
    if (drive.awaited_since && now - *drive.awaited_since > process) {
      throw DeviceError(DeviceCause::kHeartbeatLost, name_of(drive) + " sends no process data any more");
    }
  }
  if (invalid_frame_.empty()) return;
  throw DeviceError(DeviceCause::kBadAnswer, std::exchange(invalid_frame_, {}));
}

std::optional<DeviceError> DriveWatch::warning(Time now, Duration stale) const {
  if (is_error_passive_) {
    return DeviceError(DeviceCause::kBadAnswer,
                       "the bus has many errors (error passive): look at wiring and termination");
  }
  if (tx_timeout_ && now - *tx_timeout_ < kTxTimeoutStands)
    return DeviceError(DeviceCause::kWriteTimeout, "the interface could not send in time");
  for (const DriveReport& drive : drives_) {
    if (drive.emergency != 0) {
      return DeviceError(DeviceCause::kDeviceFault, name_of(drive) + with_emergency(drive));
    }
    if (drive.has_process && (drive.process.statusword & kStatusWarning) != 0) {
      return DeviceError(DeviceCause::kDeviceFault, name_of(drive) + " warns (statusword bit 7)");
    }
    const bool may_press = may_press_[static_cast<std::size_t>(&drive - drives_.data())];
    if (!may_press && drive.has_process && (drive.process.statusword & kStatusInternalLimit) != 0) {
      return DeviceError(
          DeviceCause::kDeviceFault,
          name_of(drive) +
              " is at an internal limit (statusword bit 11): check the position limits in the drive");
    }
    if (drive.awaited_since && now - *drive.awaited_since > stale) {
      return DeviceError(DeviceCause::kNoAnswer, name_of(drive) + " sends no process data");
    }
  }
  return std::nullopt;
}

}  // namespace corbot::rt
