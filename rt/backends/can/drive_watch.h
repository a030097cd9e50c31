// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {

/// This many heartbeat periods without a heartbeat are a lost drive.
inline constexpr int kHeartbeatsMissed = 3;

/// The last report of one drive.
struct DriveReport {
  using Time = std::chrono::steady_clock::time_point;

  std::uint8_t node{};
  NmtState nmt{NmtState::kBootUp};
  Time heartbeat{};            ///< time of the last heartbeat, or when it was last expected
  bool has_heartbeat{false};   ///< since clear()
  bool has_restarted{false};   ///< booted since clear()
  DriveProcessData process{};  ///< valid when has_process
  bool has_process{false};
  std::int64_t leap{0};  ///< the greatest distance of two successive positions since settle_leaps()
  std::chrono::steady_clock::duration leap_time{};  ///< between these two
  Time process_time{};                              ///< time of `process`
  std::optional<Time> awaited_since{};  ///< the first SYNC without an answer; empty: no answer is due
  std::uint16_t emergency{0};           ///< the last code; 0: none, or it was reset
  bool had_voltage{false};              ///< by bit 4 of the statusword, when it was last in operation enabled
  int ignored{0};  ///< statuswords in a row, in operation enabled, that show no following
};

/// Monitors the frames of a bus of drives. It has no clock and no bus of its own; it trusts no byte.
class DriveWatch {
 public:
  using Time = DriveReport::Time;
  using Duration = std::chrono::steady_clock::duration;

  explicit DriveWatch(const std::vector<std::uint8_t>& nodes);

  /// Drops all reports; from `now` on heartbeats are awaited.
  void clear(Time now);
  /// Takes heartbeats, process data and emergencies of these drives, and error frames of the interface;
  /// ignores all other frames.
  void take(const CanFrame& frame, Time now);
  /// From now on a drive's process data count as new, and are awaited.
  void expect_answers(Time now);
  [[nodiscard]] bool has_all_answers() const;
  /// Reports that this drive's restart is settled.
  void settle_restart(std::size_t drive) { drives_.at(drive).has_restarted = false; }
  /// Reports that the drive's statusword does not show whether it follows its targets.
  void expect_no_follow_bit(std::size_t drive) { reports_following_.at(drive) = false; }
  /// Reports that the drive may press against something: a limit of its own (statusword bit 11) is no
  /// warning.
  void expect_limit(std::size_t drive) { may_press_.at(drive) = true; }
  [[nodiscard]] bool reports_following(std::size_t drive) const { return reports_following_.at(drive); }
  /// Forgets the leaps so far.
  void settle_leaps() {
    for (DriveReport& drive : drives_) drive.leap = 0;
  }
  /// Reports that all drives are enabled: the faults reported before are settled. Warnings remain.
  void settle_faults();
  /// Restarts the heartbeat timeouts, after a time without receiving.
  void forgive(Time now);

  [[nodiscard]] const std::vector<DriveReport>& drives() const { return drives_; }

  /// Throws DeviceError for a fault of the bus.
  void check_bus() const;
  /// Does the same for operational drives. It requires heartbeats at least every `heartbeat`, no restart,
  /// process data not overdue for longer than `process`, and no invalid frame since the last call. If they
  /// are to be enabled, it also requires no other state, no fault, and no ignored target. If they are not, it
  /// checks that STO is not active, as far as a drive shows that. Some drives have no voltage (bit 4)
  /// whenever they are off.
  void check(Time now, Duration heartbeat, Duration process, bool enabled = true);
  /// Returns the first problem that does not end operation, or nothing. `stale`: the time that process data
  /// may be overdue.
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
  std::optional<Time> tx_timeout_{};  ///< time of the last one
  std::string invalid_frame_;         ///< the text about the last one
};

/// Returns "node 3".
[[nodiscard]] std::string name_of(const DriveReport& drive);

}  // namespace corbot::rt
