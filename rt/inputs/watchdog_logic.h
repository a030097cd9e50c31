// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/inputs/cycle_view.h"

namespace corbot::rt {

/// The level of a watchdog output, for a charge pump that holds the servos' power: it changes every `period_ns` while the
/// cycle, the thread that serves the device and the caller of this advance, and is low otherwise. What stands still
/// for two periods and 10 ms trips it; so the last change comes within three periods and 20 ms of the last progress,
/// for a caller that is not held up itself and looks every 2 ms. A caller that was held up finds it tripped, since the
/// charge pump has let the power go meanwhile. Pure: it is given the time.
class WatchdogLogic {
 public:
  static constexpr std::int64_t kSlack_ns = 10'000'000;
  static constexpr std::int64_t kRecovered_ns = 50'000'000;

  explicit WatchdogLogic(std::int64_t period_ns)
      : period_ns_(period_ns), stale_ns_(2 * period_ns + kSlack_ns) {}

  /// Real-time safe. `may_run`: there may be power. It begins once everything has been seen to advance, and, after it has
  /// tripped, once may_run was withdrawn and given again. Returns the level.
  bool step(std::int64_t now_ns, bool may_run, const CycleView& view) noexcept;
  /// The line could not be switched: the charge pump has let the power go.
  void trip() noexcept;
  /// It has ended because something stood still, and not everything has advanced again for kRecovered_ns.
  [[nodiscard]] bool is_tripped() const noexcept { return is_tripped_; }
  /// Of the next change of the level; only while it changes.
  [[nodiscard]] std::int64_t due_ns() const noexcept { return due_ns_; }
  [[nodiscard]] bool is_running() const noexcept { return is_running_; }
  /// What stood still when it tripped. Static text, ASCII.
  [[nodiscard]] const char* cause() const noexcept { return cause_; }

 private:
  /// What stands still; null: nothing.
  [[nodiscard]] const char* stale(std::int64_t now_ns) const noexcept;
  void watch(std::int64_t now_ns, const CycleView& view) noexcept;

  const std::int64_t period_ns_;
  const std::int64_t stale_ns_;
  bool is_first_{true};
  bool has_advanced_{false};  ///< the cycle, since the first step
  std::uint64_t cycle_{0};
  std::uint32_t bus_beats_{0};
  std::int64_t cycle_at_ns_{0};
  std::int64_t bus_at_ns_{0};
  std::int64_t own_at_ns_{0};   ///< the last step
  std::int64_t own_gap_ns_{0};  ///< before it
  std::int64_t bad_at_ns_{0};
  std::int64_t due_ns_{0};
  bool is_running_{false};
  bool is_tripped_{false};
  bool awaits_off_{false};  ///< has tripped, and may_run has not been withdrawn since
  bool level_{false};
  const char* cause_{""};
};

}  // namespace corbot::rt
