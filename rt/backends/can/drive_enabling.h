// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "corbot/running_time.h"
#include "rt/backends/can/drive_bus.h"

namespace corbot::rt {

/// Takes drives to 'operation enabled', and back where that fails. A drive that has restarted since it was
/// last in operation must still count as before.
class DriveEnabling {
 public:
  /// `most_sag`: by drive, the counts by which its position may differ after a restart.
  /// `stagger`: from one drive's being enabled to the next one's beginning; 0: all at once.
  /// `bus` must outlive this.
  DriveEnabling(DriveBus& bus, std::vector<double> most_sag, std::chrono::milliseconds stagger);

  /// Remembers the restarts in the watch, before it is cleared.
  void note_restarts();
  void note_restart(std::size_t drive) { has_restarted_.at(drive) = true; }
  /// Where the drives are in operation.
  void note_positions();

  /// Returns the positions at which they hold, or nothing when it was stopped. Drives that it has enabled are
  /// disabled again then, and when it throws; those that held before go on holding.
  std::optional<std::vector<std::int32_t>> enable(const std::function<bool()>& is_stopped);
  /// Takes the voltage from all that answer; throws when one keeps it.
  void disable_all();
  /// Where set-points no longer arrive: each brings itself to rest by its own ramp (605Ah, 6085h); then voltage off. What
  /// is still reached gets it, and nothing is reported.
  void quick_stop() noexcept;

 private:
  using Clock = DriveBus::Clock;

  std::optional<std::vector<std::int32_t>> enable_all(const std::function<bool()>& is_stopped);
  /// Of one drive on its way.
  struct Progress {
    bool has_begun{false};  ///< its turn has come
    std::uint16_t word{kDisableVoltage};
    Clock::time_point stepped{};
    bool is_asked{false};
    bool has_been_reset{false};
    bool was_operational{false};
    bool had_voltage{false};
    bool was_well{false};  ///< without a fault
  };
  /// Throws when a drive has lost its voltage, or got a fault, since this began: whether its turn has come or not, what
  /// comes back by itself must not be energised.
  void check_steady(std::size_t drive, Progress& progress);
  /// The next controlword of a drive; throws when it has failed on the way.
  void lead(std::size_t drive, Progress& progress);
  [[nodiscard]] bool is_ready(std::size_t drive, const Progress& progress) const;
  [[nodiscard]] RunningTime begin_waiting() const;
  void ask_positions(std::uint16_t word);
  void send_to_all(std::uint16_t word);
  /// Takes the voltage from those that were not enabled before.
  void disable(const std::vector<bool>& was_enabled) noexcept;
  void check_answered(const DriveReport& drive) const;
  /// Throws when a drive that has restarted counts otherwise than before.
  void check_counts() const;
  [[noreturn]] void fail_not_enabled(std::size_t drive);

  DriveBus& bus_;
  const std::vector<double> most_sag_;
  const std::chrono::milliseconds stagger_;
  std::vector<std::optional<std::int32_t>> positions_;  ///< when the drive was last in operation
  std::vector<bool> has_restarted_;                     ///< since then
};

}  // namespace corbot::rt
