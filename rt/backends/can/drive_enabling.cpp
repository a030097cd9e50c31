// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_enabling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "corbot/running_time.h"
#include "rt/backends/can/cia402_setup.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr auto kAnswersWithin = 2s;
constexpr auto kAskWithin = 500ms;  ///< after this time the voltage goes off anyway
constexpr auto kEnableWithin = 5s;
constexpr auto kDisableWithin = 1s;
/// A quick stop; some drives stay in it by their 605Ah.
constexpr auto kStopWithin = 1s;
/// A controlword stands this long before the next step: a statusword replies to the previous one.
constexpr auto kStep = 20ms;
/// A bus that is full this many times in a row, DriveBus::kSendWithin each, is a failure.
constexpr int kMostFull = 20;
/// No shaft moves by its greatest sag in a shorter time.
constexpr auto kSagWithin = 20ms;
constexpr int kMoreLooks = 2;  // at the positions, before any energy

/// The greatest sag of a drive's shaft during a restart, near_q() of it for a sliding joint. After a greater
/// one its count has begun anew.
constexpr double kSag_rad = 0.05;
constexpr double kSagOfGripper = 0.05;

std::vector<double> most_sag(const Cia402Settings& settings) {
  std::vector<double> counts;
  for (const JointDrive& joint : settings.joints)
    counts.push_back(near_q(joint.kind, kSag_rad) * joint.counts_per_q);
  if (settings.gripper) {
    counts.push_back(kSagOfGripper * std::abs(settings.gripper->open_count - settings.gripper->closed_count));
  }
  return counts;
}

}  // namespace

DriveEnabling::DriveEnabling(DriveBus& bus, const Cia402Settings& settings)
    : bus_(bus),
      most_sag_(most_sag(settings)),
      stagger_(settings.stagger_ms),
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
    throw DeviceError(DeviceCause::kCountChanged,
                      bus_.interface() + ": " + name_of(drives[i]) + " counts " + std::to_string(now) +
                          " after its restart, it stood at " + std::to_string(*positions_[i]) +
                          ": reference it, then restart corbot");
  }
}

/// A wrong position would become the target, and the shaft leap there.
void DriveEnabling::check_leap(std::size_t index) const {
  const DriveReport& drive = bus_.drives()[index];
  const double times = std::max(1.0, std::chrono::duration<double>(drive.leap_time) / kSagWithin);
  if (static_cast<double>(drive.leap) <= times * most_sag_[index]) return;
  throw DeviceError(DeviceCause::kBadAnswer, bus_.interface() + ": " + name_of(drive) +
                                                 " reports positions that are " + std::to_string(drive.leap) +
                                                 " counts apart, one after the other: was it moved, or do "
                                                 "two drives have this number?");
}

std::optional<std::vector<std::int32_t>> DriveEnabling::enable(const std::function<bool()>& is_stopped) {
  const auto& drives = bus_.drives();
  // A first SYNC without a controlword queries the positions: a drive may be enabled, and holds.
  bus_.request_answers(Clock::now() + DriveBus::kSendWithin);
  bus_.await_answers(Clock::now() + kAnswersWithin);
  for (const DriveReport& drive : drives) check_answered(drive);
  // A drive's first answer may be old. The next ones show whether its position is one that a shaft has.
  bus_.watch().settle_leaps();
  for (int i = 0; i < kMoreLooks; ++i) {
    bus_.request_answers(Clock::now() + DriveBus::kSendWithin);
    bus_.await_answers(Clock::now() + std::max<Clock::duration>(kStep, bus_.period()));
  }
  check_counts();
  std::vector<bool> was_enabled;
  for (const DriveReport& drive : drives) {
    was_enabled.push_back(state_of(drive.process.statusword) == DriveState::kOperationEnabled);
  }
  std::optional<std::vector<std::int32_t>> targets;
  try {
    targets = enable_all(is_stopped);
  } catch (const DeviceError&) {
    disable(was_enabled);
    throw;
  }
  if (!targets) {
    disable(was_enabled);
    return std::nullopt;
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
    return;  // the bus is cut: the original failure is reported
  }
}

void DriveEnabling::fail_not_enabled(std::size_t index) {
  const DriveReport& drive = bus_.drives()[index];
  const std::uint16_t code = read_error_code(bus_.port(), bus_.watch(), drive.node);
  const std::uint16_t word = drive.process.statusword;  // its present state
  const DriveState state = state_of(word);
  const std::string who = bus_.interface() + ": " + name_of(drive);
  const std::string why = code != 0 ? ": " + describe_emergency(code) : "";
  if (state == DriveState::kOperationEnabled) {
    throw DeviceError(DeviceCause::kTargetIgnored,
                      who +
                          " does not follow its target positions (statusword bit 12 is 0). Where a drive "
                          "does not have this bit: reports_following = false");
  }
  const bool no_voltage = (word & kStatusVoltage) == 0 || code == kTorqueOffCode;
  const bool has_fault =
      code != 0 || state == DriveState::kFault || state == DriveState::kFaultReactionActive;
  throw DeviceError(no_voltage  ? DeviceCause::kTorqueOff
                    : has_fault ? DeviceCause::kDeviceFault
                                : DeviceCause::kDisabled,
                    who + " cannot be enabled, it is in '" + to_string(state) + "'" +
                        (no_voltage ? ", with safe torque off or without voltage" : "") + why);
}

void DriveEnabling::check_steady(std::size_t index, Progress& progress) {
  const std::uint16_t word = bus_.drives()[index].process.statusword;
  const DriveState state = state_of(word);
  const bool has_voltage = (word & kStatusVoltage) != 0;
  const bool is_well = state != DriveState::kFault && state != DriveState::kFaultReactionActive;
  if ((progress.had_voltage && !has_voltage) || (progress.was_well && !is_well)) fail_not_enabled(index);
  progress.had_voltage |= has_voltage;
  progress.was_well |= is_well;
}

/// Advances a drive by one step. A fault is reset once: if it comes back, a person must act. A drive that was
/// in operation and has left it is not brought back.
void DriveEnabling::lead(std::size_t index, Progress& progress) {
  const DriveReport& drive = bus_.drives()[index];
  const DriveState state = state_of(drive.process.statusword);
  if (progress.was_operational && state != DriveState::kOperationEnabled) fail_not_enabled(index);
  progress.was_operational |= state == DriveState::kOperationEnabled && progress.is_asked;
  if (progress.is_asked && Clock::now() - progress.stepped < kStep) return;
  const std::uint16_t word = controlword_towards_operation(state, progress.word);
  if (word == kFaultReset && std::exchange(progress.has_been_reset, true)) fail_not_enabled(index);
  if (word != progress.word || !progress.is_asked) progress.stepped = Clock::now();
  progress.word = word;
  progress.is_asked = true;
}

bool DriveEnabling::is_ready(std::size_t index, const Progress& progress) const {
  const std::uint16_t word = bus_.drives()[index].process.statusword;
  const bool follows = (word & kStatusFollows) != 0 || !bus_.watch().reports_following(index);
  return state_of(word) == DriveState::kOperationEnabled && progress.word == kEnableOperation && follows;
}

std::optional<std::vector<std::int32_t>> DriveEnabling::enable_all(const std::function<bool()>& is_stopped) {
  const auto& drives = bus_.drives();
  std::vector<Progress> progress(drives.size());
  std::vector<std::uint16_t> words(drives.size(), kDisableVoltage);
  std::vector<std::int32_t> targets(drives.size(), 0);
  std::vector<bool> is_holding(drives.size(), false);
  const Clock::duration within = kEnableWithin + static_cast<std::int64_t>(drives.size()) * stagger_;
  RunningTime waited(2 * bus_.period(), Clock::now());
  auto next_turn = Clock::now();
  int full = 0;
  for (auto due = Clock::now();; due += bus_.period()) {
    bool all_ready = true;
    bool is_turn = Clock::now() >= next_turn;  // true when all drives before it are in operation
    for (std::size_t i = 0; i < drives.size(); ++i) {
      check_answered(drives[i]);
      check_leap(i);
      check_steady(i, progress[i]);
      // No target jumps. A drive that holds its load keeps its target, or it would sink a little every time.
      if (!is_holding[i]) targets[i] = drives[i].process.position;
      const bool was_holding = is_holding[i];
      is_holding[i] = state_of(drives[i].process.statusword) == DriveState::kOperationEnabled;
      if (is_holding[i] && !was_holding && progress[i].is_asked) {
        next_turn = Clock::now() + stagger_;
        is_turn = false;
      }
      // A drive that already holds its load goes on doing so.
      progress[i].has_begun |= is_holding[i] || is_turn || stagger_.count() == 0;
      is_turn = is_turn && is_holding[i];
      all_ready = all_ready && is_ready(i, progress[i]);
      if (progress[i].has_begun) lead(i, progress[i]);
      words[i] = progress[i].word;
    }
    if (all_ready) break;
    if (waited.look(Clock::now()) > within) {
      for (std::size_t i = 0; i < drives.size(); ++i) {
        if (!is_ready(i, progress[i])) fail_not_enabled(i);
      }
    }
    try {
      if (is_stopped()) return std::nullopt;
      bus_.synchronise(words, targets);
      full = 0;
    } catch (const DeviceError& error) {
      // A bus that is busy for a moment must not hide why a drive cannot be enabled. The next round sends
      // the targets of then.
      if (error.cause() != DeviceCause::kWriteTimeout || ++full == kMostFull) throw;
      due = Clock::now();  // the rounds that are late are not made up
    }
    bus_.listen(due + bus_.period(), [] { return false; });
    bus_.watch().check_bus();
  }
  return targets;
}

/// Starts the timer of a wait: of the time between two looks, at most kStep or two periods count.
RunningTime DriveEnabling::begin_waiting() const {
  return {std::max<Clock::duration>(kStep, 2 * bus_.period()), Clock::now()};
}

/// Queries the positions. After the bus was opened no drive has reported its position, and one that is still
/// enabled would be sent to zero. Drives that have reported get `word` meanwhile, and wait for no other.
void DriveEnabling::ask_positions(std::uint16_t word) {
  const auto has_process = [](const DriveReport& drive) { return drive.has_process; };
  RunningTime waited = begin_waiting();
  while (!std::all_of(bus_.drives().begin(), bus_.drives().end(), has_process) &&
         waited.look(Clock::now()) < kAskWithin) {
    const auto deadline = Clock::now() + DriveBus::kSendWithin;
    for (const DriveReport& drive : bus_.drives()) {
      if (drive.has_process)
        bus_.port().write(rpdo_frame(drive.node, word, drive.process.position), deadline);
    }
    bus_.request_answers(deadline);
    bus_.await_answers(Clock::now() + std::max<Clock::duration>(kStep, bus_.period()));
  }
}

void DriveEnabling::send_to_all(std::uint16_t word) {
  // A drive may still follow its target. The position that it has reported last may be old, or behind the
  // target.
  std::vector<std::int32_t> targets = bus_.targets();
  if (targets.empty()) {
    ask_positions(word);
    for (const DriveReport& drive : bus_.drives()) targets.push_back(drive.process.position);
  }
  const std::vector<std::uint16_t> words(targets.size(), word);
  bus_.synchronise(words, std::move(targets));
  bus_.await_answers(Clock::now() + std::max<Clock::duration>(kStep, bus_.period()));
  bus_.settle_synchronisation();
}

void DriveEnabling::disable_all() {
  const auto& drives = bus_.drives();
  RunningTime waited = begin_waiting();
  for (;;) {
    send_to_all(kDisableVoltage);
    const auto powered = std::find_if(drives.begin(), drives.end(), [](const DriveReport& drive) {
      return !drive.has_process || is_powered(state_of(drive.process.statusword));
    });
    if (powered == drives.end()) return;
    bus_.watch().check_bus();
    if (waited.look(Clock::now()) <= kDisableWithin) continue;
    throw DeviceError(DeviceCause::kDeviceFault, bus_.interface() + ": " + name_of(*powered) +
                                                     " keeps its voltage, it is in '" +
                                                     to_string(state_of(powered->process.statusword)) + "'");
  }
}

void DriveEnabling::quick_stop() noexcept {
  const auto& drives = bus_.drives();
  const auto stops = [](const DriveReport& drive) {
    return !drive.awaited_since && is_powered(state_of(drive.process.statusword));
  };
  try {
    RunningTime waited = begin_waiting();
    do {
      send_to_all(kQuickStop);
    } while (std::any_of(drives.begin(), drives.end(), stops) && waited.look(Clock::now()) < kStopWithin);
    send_to_all(kDisableVoltage);
  } catch (const DeviceError&) {
    return;  // the bus is cut: only the drives' own reaction is left
  }
}

}  // namespace corbot::rt
