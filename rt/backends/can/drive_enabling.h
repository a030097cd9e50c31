// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "rt/backends/can/drive_bus.h"

namespace corbot::rt {

/// Takes drives to 'operation enabled', and back where that fails. A drive that has restarted since it was
/// last in operation must still count as before.
class DriveEnabling {
 public:
  /// `most_sag`: by drive, the counts by which its position may differ after a restart.
  /// `bus` must outlive this.
  DriveEnabling(DriveBus& bus, std::vector<double> most_sag);

  /// Remembers the restarts in the watch, before it is cleared.
  void note_restarts();
  void note_restart(std::size_t drive) { has_restarted_.at(drive) = true; }
  /// Where the drives are in operation.
  void note_positions();

  /// Returns the positions at which they hold. Drives that it has enabled are disabled again when it throws;
  /// those that held before go on holding.
  std::vector<std::int32_t> enable();

 private:
  using Clock = DriveBus::Clock;

  std::vector<std::int32_t> enable_all();
  /// Takes the voltage from those that were not enabled before.
  void disable(const std::vector<bool>& was_enabled) noexcept;
  void check_answered(const DriveReport& drive) const;
  /// Throws when a drive that has restarted counts otherwise than before.
  void check_counts() const;
  [[noreturn]] void fail_not_enabled(const DriveReport& drive);

  DriveBus& bus_;
  const std::vector<double> most_sag_;
  std::vector<std::optional<std::int32_t>> positions_;  ///< when the drive was last in operation
  std::vector<bool> has_restarted_;                     ///< since then
};

}  // namespace corbot::rt
