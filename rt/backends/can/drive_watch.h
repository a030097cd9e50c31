// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {

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
  bool is_fresh{false};        ///< since expect_answers()
  Time process_time{};         ///< of `process`
  Time awaited_since{};        ///< unless is_fresh: the first SYNC without an answer
  std::uint16_t emergency{0};  ///< the last; 0: none, or taken back
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
  /// All drives are enabled: the faults that were reported up to here are dealt with. Warnings stand.
  void settle_faults();
  /// Restarts the heartbeat timeouts, after a time without receiving.
  void forgive(Time now);

  [[nodiscard]] const std::vector<DriveReport>& drives() const { return drives_; }

  /// Throws DeviceError for what is the matter on the bus.
  void check_bus() const;
  /// The same for drives that are operational and enabled: heartbeats at least every `heartbeat`, no fault,
  /// no restart, process data not overdue for longer than `process`,
  /// no invalid frame since the last call.
  void check(Time now, Duration heartbeat, Duration process);
  /// The first problem that does not end operation, or nothing. `stale`: process data may be overdue so long.
  [[nodiscard]] std::optional<DeviceError> warning(Time now, Duration stale) const;

 private:
  void take_error(const CanFrame& frame, Time now);
  void take_process(DriveReport& drive, const CanFrame& frame, Time now);

  std::vector<DriveReport> drives_;
  bool is_bus_off_{false};
  bool is_error_passive_{false};
  std::optional<Time> tx_timeout_{};  ///< the last
  std::string invalid_frame_;         ///< the text about the last one
};

/// "node 3"
[[nodiscard]] std::string name_of(const DriveReport& drive);

}  // namespace corbot::rt
