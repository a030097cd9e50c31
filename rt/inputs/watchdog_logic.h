// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/inputs/cycle_view.h"

namespace corbot::rt {

/// The level of a watchdog output, for a charge pump that holds the servos' power. It changes every
/// `period_ns` while the cycle, the thread that serves the device and the caller advance, and is low
/// otherwise. A standstill of two periods and 10 ms of any of them trips it. So the last change comes within
/// three periods and 20 ms of the last progress. This holds if the caller is not delayed itself and calls
/// every 2 ms. A delayed caller finds it tripped, since the charge pump has cut the power meanwhile. Pure: it
/// is given the time.
class WatchdogLogic {
 public:
  static constexpr std::int64_t kSlack_ns = 10'000'000;
  static constexpr std::int64_t kRecovered_ns = 50'000'000;

  explicit WatchdogLogic(std::int64_t period_ns)
      : period_ns_(period_ns), stale_ns_(2 * period_ns + kSlack_ns) {}

  /// Real-time safe. `may_run`: power is allowed. The output begins once everything has been seen to advance.
  /// After a trip it also requires that may_run was withdrawn and given again. Returns the level.
  bool step(std::int64_t now_ns, bool may_run, const CycleView& view) noexcept;
  /// Reports that the line could not be switched: the charge pump has cut the power.
  void trip() noexcept;
  /// True after a standstill, until everything has advanced again for kRecovered_ns.
  [[nodiscard]] bool is_tripped() const noexcept { return is_tripped_; }
  /// Returns the time of the next change of the level; valid only while it changes.
  [[nodiscard]] std::int64_t due_ns() const noexcept { return due_ns_; }
  [[nodiscard]] bool is_running() const noexcept { return is_running_; }
  /// Returns the cause of the trip. Static text, ASCII.
  [[nodiscard]] const char* cause() const noexcept { return cause_; }

 private:
  /// Returns the cause of a standstill; null: nothing stands still.
  [[nodiscard]] const char* stale(std::int64_t now_ns) const noexcept;
  void watch(std::int64_t now_ns, const CycleView& view) noexcept;

  const std::int64_t period_ns_;
  const std::int64_t stale_ns_;
  bool is_first_{true};
  bool has_advanced_{false};  ///< the cycle has advanced since the first step
  std::uint64_t cycle_{0};
  std::uint32_t bus_beats_{0};
  std::int64_t cycle_at_ns_{0};
  std::int64_t bus_at_ns_{0};
  std::int64_t own_at_ns_{0};   ///< time of the last step
  std::int64_t own_gap_ns_{0};  ///< time between the last two steps
  std::int64_t bad_at_ns_{0};
  std::int64_t due_ns_{0};
  bool is_running_{false};
  bool is_tripped_{false};
  bool awaits_off_{false};  ///< has tripped, and may_run has not been withdrawn since
  bool level_{false};
  const char* cause_{""};
};

}  // namespace corbot::rt
