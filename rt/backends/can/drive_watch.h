// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {

/// So many heartbeat periods without a heartbeat are a lost drive.
inline constexpr int kHeartbeatsMissed = 3;

/// What one drive has reported last.
struct DriveReport {
  using Time = std::chrono::steady_clock::time_point;

  std::uint8_t node{};
  NmtState nmt{NmtState::kBootUp};
  Time heartbeat{};            ///< when it came last, or was last expected
  bool has_heartbeat{false};   ///< since clear()
  bool has_restarted{false};   ///< booted since clear()
  DriveProcessData process{};  ///< valid when has_process
  bool has_process{false};
  Time process_time{};                  ///< of `process`
  std::optional<Time> awaited_since{};  ///< the first SYNC without an answer; none: it owes no answer
  std::uint16_t emergency{0};           ///< the last; 0: none, or taken back
  bool had_voltage{false};              ///< by bit 4 of the statusword, when it was last in operation enabled
  int ignored{0};  ///< statuswords in a row, in operation enabled, by which it follows no target
};

/// Monitors the frames of a bus of drives. Has no clock and no bus of its own; trusts no byte.
class DriveWatch {
 public:
  using Time = DriveReport::Time;
  using Duration = std::chrono::steady_clock::duration;

  explicit DriveWatch(const std::vector<std::uint8_t>& nodes);

  /// Drops all reports; from `now` on heartbeats are awaited.
  void clear(Time now);
  /// Heartbeats, process data and emergencies of these drives, error frames of the interface;
  /// all else is ignored.
  void take(const CanFrame& frame, Time now);
  /// From now on a drive's process data count as new, and are awaited.
  void expect_answers(Time now);
  [[nodiscard]] bool has_all_answers() const;
  /// This drive's restart is dealt with.
  void settle_restart(std::size_t drive) { drives_.at(drive).has_restarted = false; }
  /// Its statusword does not tell whether it follows its targets.
  void expect_no_follow_bit(std::size_t drive) { reports_following_.at(drive) = false; }
  /// It may press against something: a limit of its own (statusword bit 11) is no warning.
  void expect_limit(std::size_t drive) { may_press_.at(drive) = true; }
  [[nodiscard]] bool reports_following(std::size_t drive) const { return reports_following_.at(drive); }
  /// All drives are enabled: the faults that were reported up to here are dealt with. Warnings stand.
  void settle_faults();
  /// Restarts the heartbeat timeouts, after a time without receiving.
  void forgive(Time now);

  [[nodiscard]] const std::vector<DriveReport>& drives() const { return drives_; }

  /// Throws DeviceError for what is the matter on the bus.
  void check_bus() const;
  /// The same for drives that are operational: heartbeats at least every `heartbeat`, no restart, process data
  /// not overdue for longer than `process`, no invalid frame since the last call; and, where they are to be
  /// enabled, no other state, no fault, and no target that is not followed; where they are not, no torque that is off
  /// by STO, as far as a drive shows that: some have no voltage (bit 4) whenever they are off.
  void check(Time now, Duration heartbeat, Duration process, bool enabled = true);
  /// The first problem that does not end operation, or nothing. `stale`: process data may be overdue so long.
  [[nodiscard]] std::optional<DeviceError> warning(Time now, Duration stale) const;

 private:
  void take_error(const CanFrame& frame, Time now);
  void check_enabled(const DriveReport& drive, bool reports_following) const;
  static void check_off(const DriveReport& drive, bool shows_voltage);
  void take_process(DriveReport& drive, const CanFrame& frame, Time now);

  std::vector<DriveReport> drives_;
  std::vector<bool> reports_following_;
  std::vector<bool> may_press_;
  std::vector<bool> shows_voltage_;  ///< it was off, with bit 4 of its statusword set
  bool is_bus_off_{false};
  bool is_error_passive_{false};
  std::optional<Time> tx_timeout_{};  ///< the last
  std::string invalid_frame_;         ///< the text about the last one
};

/// "node 3"
[[nodiscard]] std::string name_of(const DriveReport& drive);

}  // namespace corbot::rt
