// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_enabling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/running_time.h"
#include "rt/backends/can/cia402_setup.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr auto kPositionsWithin = 2s;
constexpr auto kEnableWithin = 5s;
/// A controlword stands this long before the next step: a statusword answers the one before it.
constexpr auto kStep = 20ms;

}  // namespace

DriveEnabling::DriveEnabling(DriveBus& bus, std::vector<double> most_sag)
    : bus_(bus),
      most_sag_(std::move(most_sag)),
      positions_(most_sag_.size()),
      has_restarted_(most_sag_.size(), false) {}

void DriveEnabling::note_restarts() {
  const auto& drives = bus_.drives();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    has_restarted_[i] = has_restarted_[i] || drives[i].has_restarted;
  }
}

void DriveEnabling::note_positions() {
  const auto& drives = bus_.drives();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (drives[i].has_process) positions_[i] = drives[i].process.position;
  }
}

void DriveEnabling::check_answered(const DriveReport& drive) const {
  if (drive.has_process && !drive.has_restarted) return;
  throw DeviceError(DeviceCause::kNoAnswer,
                    bus_.interface() + ": " + name_of(drive) +
                        (drive.has_restarted ? " has restarted" : " does not answer to SYNC"));
}

void DriveEnabling::check_counts() const {
  const auto& drives = bus_.drives();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (!has_restarted_[i] || !positions_[i]) continue;
    const std::int32_t now = drives[i].process.position;
    if (std::abs(static_cast<double>(now) - *positions_[i]) <= most_sag_[i]) continue;
    throw DeviceError(DeviceCause::kDeviceFault,
                      bus_.interface() + ": " + name_of(drives[i]) + " counts " + std::to_string(now) +
                          " after its restart, it stood at " + std::to_string(*positions_[i]) +
                          ": reference it, then restart corbot");
  }
}

std::vector<std::int32_t> DriveEnabling::enable() {
  const auto& drives = bus_.drives();
  // A first SYNC without a controlword asks where they are: one may be enabled, and holds.
  bus_.request_answers(Clock::now() + DriveBus::kSendWithin);
  bus_.await_answers(Clock::now() + kPositionsWithin);
  for (const DriveReport& drive : drives) check_answered(drive);
  check_counts();
  std::vector<bool> was_enabled;
  for (const DriveReport& drive : drives) {
    was_enabled.push_back(state_of(drive.process.statusword) == DriveState::kOperationEnabled);
  }
  std::vector<std::int32_t> targets;
  try {
    targets = enable_all();
  } catch (const DeviceError&) {
    disable(was_enabled);
    throw;
  }
  has_restarted_.assign(drives.size(), false);
  bus_.watch().settle_faults();
  return targets;
}

void DriveEnabling::disable(const std::vector<bool>& was_enabled) noexcept {
  try {
    const auto deadline = Clock::now() + std::max<Clock::duration>(DriveBus::kSendWithin, bus_.period());
    const auto& drives = bus_.drives();
    for (std::size_t i = 0; i < drives.size(); ++i) {
      if (was_enabled[i]) continue;
      bus_.port().write(rpdo_frame(drives[i].node, kDisableVoltage, drives[i].process.position), deadline);
    }
    bus_.request_answers(deadline);
    bus_.await_answers(deadline);
  } catch (const DeviceError&) {
    return;  // the bus is cut: what led here is reported
  }
}

void DriveEnabling::fail_not_enabled(const DriveReport& drive) {
  const std::uint16_t code = read_error_code(bus_.port(), bus_.watch(), drive.node);
  const DriveState state = state_of(drive.process.statusword);  // as it is by now
  throw DeviceError(DeviceCause::kDeviceFault, bus_.interface() + ": " + name_of(drive) +
                                                   " cannot be enabled, it is in '" + to_string(state) + "'" +
                                                   (code != 0 ? ": " + describe_emergency(code) : ""));
}

std::vector<std::int32_t> DriveEnabling::enable_all() {
  const auto& drives = bus_.drives();
  std::vector<std::uint16_t> words(drives.size(), kDisableVoltage);
  std::vector<std::int32_t> targets(drives.size(), 0);
  std::vector<Clock::time_point> stepped(drives.size());
  std::vector<bool> is_asked(drives.size(), false);
  std::vector<bool> is_holding(drives.size(), false);
  RunningTime waited(2 * bus_.period(), Clock::now());
  for (auto due = Clock::now();; due += bus_.period()) {
    bool is_ready = true;
    for (std::size_t i = 0; i < drives.size(); ++i) {
      const DriveReport& drive = drives[i];
      check_answered(drive);
      const DriveState state = state_of(drive.process.statusword);
      // Nothing jumps; and what holds its load keeps its target, or it would sink a little every time.
      if (!is_holding[i]) targets[i] = drive.process.position;
      is_holding[i] = state == DriveState::kOperationEnabled;
      is_ready = is_ready && state == DriveState::kOperationEnabled && words[i] == kEnableOperation;
      if (is_asked[i] && Clock::now() - stepped[i] < kStep) continue;
      const std::uint16_t word = controlword_towards_operation(state, words[i]);
      if (word != words[i] || !is_asked[i]) stepped[i] = Clock::now();
      words[i] = word;
      is_asked[i] = true;
    }
    if (is_ready) break;
    if (waited.look(Clock::now()) > kEnableWithin) {
      for (std::size_t i = 0; i < drives.size(); ++i) {
        if (state_of(drives[i].process.statusword) != DriveState::kOperationEnabled) {
          fail_not_enabled(drives[i]);
        }
      }
    }
    bus_.synchronise(words, targets);
    bus_.listen(due + bus_.period(), [] { return false; });
    bus_.watch().check_bus();
  }
  return targets;
}

}  // namespace corbot::rt
