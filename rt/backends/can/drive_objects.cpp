// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_objects.h"

#include <algorithm>

#include "corbot/running_time.h"
#include "rt/backends/can/cia402.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = CanPort::Clock;

constexpr ObjectAddress kMode{0x6060};
constexpr ObjectAddress kModeDisplay{0x6061};
constexpr ObjectAddress kStatuswordObject{0x6041};

constexpr std::uint16_t kPdos = 4;
constexpr std::uint32_t kPdoOff = 1u << 31;
constexpr std::uint32_t kNoRemoteRequest = 1u << 30;  // some devices keep it, and some do not
constexpr std::uint32_t kEverySync = 1;
constexpr auto kModeWithin = 1s;

constexpr std::uint32_t kAbortTransfer = 0x0800'0020;
constexpr std::uint32_t kAbortLocalControl = 0x0800'0021;
constexpr std::uint32_t kAbortState = 0x0800'0022;

bool depends_on_state(std::uint32_t abort_code) {
  return abort_code == kAbortTransfer || abort_code == kAbortLocalControl || abort_code == kAbortState;
}

std::uint32_t kept(std::uint32_t value, std::size_t bytes, std::uint32_t mask) {
  return value & mask & (bytes >= 4 ? 0xFFFF'FFFFu : (1u << (8 * bytes)) - 1);
}

}  // namespace

void DriveObjects::fail_refused(ObjectAddress object, std::uint32_t has, std::uint32_t needs,
                                std::size_t bytes, std::uint32_t abort_code) {
  const auto digits = static_cast<int>(2 * bytes);
  std::string hint = "; set it with its maker's tool";
  if (depends_on_state(abort_code) && state_of(statusword()) == DriveState::kOperationEnabled) {
    hint = " while the drive holds its load; take its voltage off first";
  }
  sdo_.fail(DeviceCause::kBadAnswer, to_string(object) + " is " + hex(has, digits) + ", " +
                                         hex(needs, digits) + " is needed: " + describe_abort(abort_code) +
                                         hint);
}

std::uint16_t DriveObjects::statusword() { return static_cast<std::uint16_t>(sdo_.read(kStatuswordObject)); }

std::uint8_t DriveObjects::mode() { return static_cast<std::uint8_t>(sdo_.read(kModeDisplay)); }

void DriveObjects::ensure(ObjectAddress object, std::uint32_t value, std::size_t bytes, std::uint32_t mask) {
  const auto has = sdo_.read_if_there(object);
  if (!has) {
    sdo_.fail(DeviceCause::kBadAnswer, "has no " + to_string(object) + ", where " +
                                           hex(value, static_cast<int>(2 * bytes)) + " is needed");
  }
  if (kept(*has, bytes, mask) == kept(value, bytes, mask)) return;
  if (const auto abort_code = write(object, value, bytes)) {
    fail_refused(object, kept(*has, bytes, mask), value, bytes, *abort_code);
  }
  sdo_.check(object, value, bytes, mask);
}

std::optional<std::uint32_t> DriveObjects::write(ObjectAddress object, std::uint32_t value,
                                                 std::size_t bytes) {
  auto abort_code = sdo_.try_to_write(object, value, bytes);
  if (!abort_code || !depends_on_state(*abort_code)) return abort_code;
  // A motor that holds a load goes on as it is.
  if (state_of(statusword()) == DriveState::kOperationEnabled) return abort_code;
  if (make_mode_inactive()) abort_code = sdo_.try_to_write(object, value, bytes);
  if (!abort_code || !depends_on_state(*abort_code)) return abort_code;
  if (switch_off_pdos()) abort_code = sdo_.try_to_write(object, value, bytes);
  return abort_code;
}

bool DriveObjects::make_mode_inactive() {
  if (mode() == 0) return false;
  set_mode(0);
  return true;
}

bool DriveObjects::switch_off_pdos() {
  bool had_any = false;
  for (std::uint16_t number = 0; number < kPdos; ++number) {
    for (const std::uint16_t parameters : {kRpdoParameters, kTpdoParameters}) {
      const ObjectAddress object{static_cast<std::uint16_t>(parameters + number), 1};
      const auto identifier = sdo_.read_if_there(object);
      if (!identifier || (*identifier & kPdoOff) != 0) continue;
      had_any = true;
      if (sdo_.try_to_write(object, *identifier | kPdoOff, 4)) return false;
    }
  }
  return had_any;
}

void DriveObjects::switch_off_other_pdos() {
  for (std::uint16_t number = 1; number < kPdos; ++number) {
    const ObjectAddress object{static_cast<std::uint16_t>(kTpdoParameters + number), 1};
    const auto identifier = sdo_.read_if_there(object);
    if (identifier && (*identifier & kPdoOff) == 0) ensure(object, *identifier | kPdoOff, 4);
  }
}

bool DriveObjects::is_mapped(const PdoPlan& plan) {
  if (sdo_.read({plan.mapping, 0}) != plan.entries.size()) return false;
  for (std::size_t i = 0; i < plan.entries.size(); ++i) {
    if (sdo_.read({plan.mapping, static_cast<std::uint8_t>(i + 1)}) != plan.entries[i]) return false;
  }
  return true;
}

std::string DriveObjects::mapped(std::uint16_t mapping) {
  constexpr std::uint32_t kMost = 8;
  std::string text;
  const std::uint32_t count = std::min(sdo_.read({mapping, 0}), kMost);
  for (std::uint32_t i = 1; i <= count; ++i) {
    text += " " + hex(sdo_.read({mapping, static_cast<std::uint8_t>(i)}), 8);
  }
  return count == 0 ? " nothing" : text;
}

/// Maps by CiA 301, 7.5.2.36: no entries, then the entries, then their number, all while the PDO is off.
void DriveObjects::map(const PdoPlan& plan) {
  const auto refuse = [&](ObjectAddress object, std::uint32_t abort_code) {
    std::string needed;
    for (const std::uint32_t entry : plan.entries) needed += " " + hex(entry, 8);
    sdo_.fail(DeviceCause::kBadAnswer, to_string(ObjectAddress{plan.mapping}) + " maps" +
                                           mapped(plan.mapping) + "," + needed + " is needed: writing " +
                                           to_string(object) + ": " + describe_abort(abort_code) +
                                           "; map it with its maker's tool, if that can");
  };
  const auto put = [&](std::uint8_t sub, std::uint32_t value, std::size_t bytes) {
    const ObjectAddress object{plan.mapping, sub};
    if (const auto abort_code = write(object, value, bytes)) refuse(object, *abort_code);
    sdo_.check(object, value, bytes, 0xFFFF'FFFF);
  };
  put(0, 0, 1);
  for (std::size_t i = 0; i < plan.entries.size(); ++i) {
    put(static_cast<std::uint8_t>(i + 1), plan.entries[i], 4);
  }
  put(0, static_cast<std::uint32_t>(plan.entries.size()), 1);
}

void DriveObjects::ensure_pdo(const PdoPlan& plan) {
  const bool sends = plan.parameters >= kTpdoParameters;
  const std::uint32_t identifier = (sends ? kNoRemoteRequest : 0u) | plan.identifier;
  const std::uint32_t mask = ~kNoRemoteRequest;
  const ObjectAddress where{plan.parameters, 1};
  const bool has_mapping = is_mapped(plan);
  const bool has_type = (sdo_.read({plan.parameters, 2}) & 0xFF) == kEverySync;
  if (!has_mapping || !has_type) {
    if ((sdo_.read(where) & kPdoOff) == 0) ensure(where, identifier | kPdoOff, 4, mask);
    if (!has_mapping) map(plan);
    ensure({plan.parameters, 2}, kEverySync, 1);
  }
  const std::uint32_t has = sdo_.read(where);
  if ((has & mask) == (identifier & mask)) return;
  // The identifier of an active PDO cannot be changed.
  if ((has & kPdoOff) == 0) ensure(where, has | kPdoOff, 4, mask);
  ensure(where, identifier, 4, mask);
}

void DriveObjects::set_mode(std::uint8_t mode) {
  if (this->mode() != mode) sdo_.write(kMode, mode, 1);
  RunningTime waited(kModeWithin / 5, Clock::now());
  for (;;) {
    const std::uint8_t is = this->mode();
    if (is == mode) return;
    if (waited.look(Clock::now()) >= kModeWithin) {
      sdo_.fail(DeviceCause::kBadAnswer, "stays in mode " + std::to_string(static_cast<std::int8_t>(is)) +
                                             " (6061h), " + std::to_string(mode) + " is needed");
    }
  }
}

}  // namespace corbot::rt
