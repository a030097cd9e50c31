// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "corbot/running_time.h"
#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/drive_settings.h"

namespace corbot::rt {

/// Brings drives to 'operation enabled', and back if that fails. A drive that has restarted since it was last
/// in operation must have the same count as before.
class DriveEnabling {
 public:
  /// `bus` must outlive this.
  DriveEnabling(DriveBus& bus, const Cia402Settings& settings);

  /// Remembers the restarts in the watch, before it is cleared.
  void note_restarts();
  void note_restart(std::size_t drive) { has_restarted_.at(drive) = true; }
  /// Remembers the drives' positions in operation.
  void note_positions();

  /// Returns the positions at which the drives hold, or nothing after a stop. Then, and if it throws, it
  /// disables the drives that it has enabled; drives that held before go on holding.
  std::optional<std::vector<std::int32_t>> enable(const std::function<bool()>& is_stopped);
  /// Takes the voltage from all drives that answer; throws if one keeps it.
  void disable_all();
  /// Stops if set-points no longer arrive: each drive comes to rest by its own ramp (605Ah, 6085h), then the
  /// voltage goes off. Every reachable drive gets the command, and nothing is reported.
  void quick_stop() noexcept;

 private:
  using Clock = DriveBus::Clock;

  std::optional<std::vector<std::int32_t>> enable_all(const std::function<bool()>& is_stopped);
  /// The progress of one drive.
  struct Progress {
    bool has_begun{false};  ///< its turn has come
    std::uint16_t word{kDisableVoltage};
    Clock::time_point stepped{};
    bool is_asked{false};
    bool has_been_reset{false};
    bool was_operational{false};
    bool had_voltage{false};
    bool was_well{false};  ///< it had no fault
  };
  /// Throws if a drive has lost its voltage, or got a fault, since this began, whether its turn has come or
  /// not. A drive that comes back by itself must not be energised.
  void check_steady(std::size_t drive, Progress& progress);
  /// Computes the next controlword of a drive; throws if it has failed on the way.
  void lead(std::size_t drive, Progress& progress);
  [[nodiscard]] bool is_ready(std::size_t drive, const Progress& progress) const;
  [[nodiscard]] RunningTime begin_waiting() const;
  void ask_positions(std::uint16_t word);
  void send_to_all(std::uint16_t word);
  /// Takes the voltage from the drives that were not enabled before.
  void disable(const std::vector<bool>& was_enabled) noexcept;
  void check_answered(const DriveReport& drive) const;
  /// Throws if a drive that has restarted has another count than before.
  void check_counts() const;
  /// Throws if the drive's positions lie further apart than a shaft moves so quickly.
  void check_leap(std::size_t drive) const;
  [[noreturn]] void fail_not_enabled(std::size_t drive);

  DriveBus& bus_;
  const std::vector<double> most_sag_;       ///< counts by which a position may differ after a restart
  const std::chrono::milliseconds stagger_;  ///< from a drive's being enabled to the next one's beginning
  std::vector<std::optional<std::int32_t>> positions_;  ///< position when the drive was last in operation
  std::vector<bool> has_restarted_;                     ///< since it was last in operation
};

}  // namespace corbot::rt
