// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {

/// What one drive has told last.
struct DriveReport {
  using Time = std::chrono::steady_clock::time_point;

  std::uint8_t node{};
  NmtState nmt{NmtState::kBootUp};
  Time heartbeat{};            ///< when it was heard last, or when it was last expected
  bool has_heartbeat{false};   ///< since clear()
  bool has_restarted{false};   ///< booted since clear()
  DriveProcessData process{};  ///< valid when has_process
  bool has_process{false};
  bool is_fresh{false};        ///< since expect_answers()
  Time process_time{};         ///< of `process`
  Time awaited_since{};        ///< unless is_fresh: the first SYNC without an answer
  std::uint16_t emergency{0};  ///< the last; 0: none, or taken back
};

/// Listens to a bus of drives and judges what it hears. Knows no clock and no bus; trusts no byte.
class DriveWatch {
 public:
  using Time = DriveReport::Time;
  using Duration = std::chrono::steady_clock::duration;

  explicit DriveWatch(const std::vector<std::uint8_t>& nodes);

  /// Forgets all that was heard; from `now` on heartbeats are awaited.
  void clear(Time now);
  /// Heartbeats, process data and emergencies of these drives, error frames of the interface; all else is
  /// ignored.
  void take(const CanFrame& frame, Time now);
  /// From now on a drive's process data count as new, and are awaited.
  void expect_answers(Time now);
  [[nodiscard]] bool has_all_answers() const;
  /// This drive's restart is dealt with.
  void settle_restart(std::size_t drive) { drives_.at(drive).has_restarted = false; }
  /// All drives are enabled: the faults that were reported up to here are dealt with. Warnings stand.
  void settle_faults();
  /// Heartbeats that could not be heard are not missed.
  void forgive(Time now);

  [[nodiscard]] const std::vector<DriveReport>& drives() const { return drives_; }

  /// Throws DeviceError for what is the matter on the bus.
  void check_bus() const;
  /// The same for drives that are operational and enabled: heartbeats at least every `heartbeat`, no fault,
  /// no restart, process data not owed for longer than `process`, no frame that makes no sense since the last
  /// call.
  void check(Time now, Duration heartbeat, Duration process);
  /// What is wrong, but can be lived with: nothing, or the first. `stale`: process data may be owed so long.
  [[nodiscard]] std::optional<DeviceError> warning(Time now, Duration stale) const;

 private:
  void take_error(const CanFrame& frame, Time now);
  void take_process(DriveReport& drive, const CanFrame& frame, Time now);

  std::vector<DriveReport> drives_;
  bool is_bus_off_{false};
  bool is_error_passive_{false};
  std::optional<Time> tx_timeout_{};  ///< the last
  std::string nonsense_;              ///< about a frame that could not be understood
};

/// "node 3"
[[nodiscard]] std::string name_of(const DriveReport& drive);

}  // namespace corbot::rt
