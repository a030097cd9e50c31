// SPDX-License-Identifier: Apache-2.0
// The way to 'operation enabled', and back where it fails.
#include <algorithm>
#include <cmath>

#include "rt/backends/can/cia402_setup.h"
#include "rt/backends/can/socketcan.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr auto kPositionsWithin = 2s;
constexpr auto kEnableWithin = 5s;
/// A controlword stands this long before the next step: a statusword answers the one before it.
constexpr auto kStep = 20ms;
/// So far the shaft of a drive that restarts may sag; more, and its count has begun anew.
constexpr double kSag_rad = 0.05;
constexpr double kSagOfGripper = 0.05;

}  // namespace

void Cia402Drives::note_restarts() {
  const auto& drives = watch_.drives();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    has_restarted_[i] = has_restarted_[i] || drives[i].has_restarted;
  }
}

void Cia402Drives::check_answered(const DriveReport& drive) const {
  if (drive.has_process && !drive.has_restarted) return;
  throw DeviceError(DeviceCause::kNoAnswer,
                    settings_.interface + ": " + name_of(drive) +
                        (drive.has_restarted ? " has restarted" : " does not answer to SYNC"));
}

void Cia402Drives::check_counts() const {
  const auto& drives = watch_.drives();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (!has_restarted_[i] || !served_at_[i]) continue;
    const double most =
        i < settings_.joints.size()
            ? kSag_rad * settings_.joints[i].counts_per_rad
            : kSagOfGripper * std::abs(settings_.gripper->open_count - settings_.gripper->closed_count);
    const std::int32_t now = drives[i].process.position;
    if (std::abs(static_cast<double>(now) - *served_at_[i]) <= most) continue;
    throw DeviceError(DeviceCause::kDeviceFault,
                      settings_.interface + ": " + name_of(drives[i]) + " counts " + std::to_string(now) +
                          " after its restart, it stood at " + std::to_string(*served_at_[i]) +
                          ": reference it, then restart corbot");
  }
}

void Cia402Drives::enable() {
  const auto& drives = watch_.drives();
  // A first SYNC without a word to the drives tells where they are: one may be enabled, and holds.
  watch_.expect_answers(Clock::now());
  port_.write(sync_frame(), Clock::now() + kSendWithin);
  listen(Clock::now() + kPositionsWithin, [&] { return watch_.has_all_answers(); });
  for (const DriveReport& drive : drives) check_answered(drive);
  check_counts();
  std::vector<bool> was_enabled;
  for (const DriveReport& drive : drives) {
    was_enabled.push_back(state_of(drive.process.statusword) == DriveState::kOperationEnabled);
  }
  try {
    enable_all();
  } catch (const DeviceError&) {
    disable(was_enabled);
    throw;
  }
  has_restarted_.assign(drives.size(), false);
  watch_.settle_faults();
}

void Cia402Drives::disable(const std::vector<bool>& was_enabled) noexcept {
  try {
    const auto deadline = Clock::now() + std::max<Clock::duration>(kSendWithin, cycle());
    const auto& drives = watch_.drives();
    for (std::size_t i = 0; i < drives.size(); ++i) {
      if (was_enabled[i]) continue;
      port_.write(rpdo_frame(drives[i].node, kDisableVoltage, drives[i].process.position), deadline);
    }
    watch_.expect_answers(Clock::now());
    port_.write(sync_frame(), deadline);
    listen(deadline, [this] { return watch_.has_all_answers(); });
  } catch (const DeviceError&) {
    return;  // the bus is cut: what brought us here is told
  }
}

void Cia402Drives::enable_all() {
  const auto& drives = watch_.drives();
  std::vector<std::uint16_t> words(drives.size(), kDisableVoltage);
  std::vector<std::int32_t> targets(drives.size(), 0);
  std::vector<Clock::time_point> stepped(drives.size());
  std::vector<bool> is_asked(drives.size(), false);
  std::vector<bool> is_holding(drives.size(), false);
  const auto deadline = Clock::now() + kEnableWithin;
  for (auto due = Clock::now();; due += cycle()) {
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
    if (Clock::now() > deadline) {
      for (std::size_t i = 0; i < drives.size(); ++i) {
        if (state_of(drives[i].process.statusword) == DriveState::kOperationEnabled) continue;
        const std::uint16_t code = read_error_code(port_, watch_, drives[i].node);
        throw DeviceError(DeviceCause::kDeviceFault,
                          settings_.interface + ": " + name_of(drives[i]) + " cannot be enabled, it is in '" +
                              in_words(state_of(drives[i].process.statusword)) + "'" +
                              (code != 0 ? ": " + emergency_in_words(code) : ""));
      }
    }
    synchronise(words, targets);
    listen(due + cycle(), [] { return false; });
    watch_.check_bus();
  }
  last_targets_ = targets;
}

}  // namespace corbot::rt
