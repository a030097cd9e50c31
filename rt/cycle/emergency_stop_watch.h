// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// Reports each press of the emergency stop once, and which sources are active. It also detects that the
/// thread that watches the inputs has stalled, which counts as a press. Real-time safe.
class EmergencyStopWatch {
 public:
  /// A watching thread that has not looked for this long, in time that the cycle ran, has stalled. The time
  /// counts from its start, so that a thread that never looks is found too.
  static constexpr std::int64_t kWatcherSilent_ns = 100'000'000;

  explicit EmergencyStopWatch(EmergencyStop& stop) noexcept : stop_(stop), beats_(stop.beats()) {}

  /// Called once a step. `ran_ns`: time that has passed, without gaps of this process. True if there was a
  /// press since the last call, even if it was released meanwhile.
  [[nodiscard]] bool see(std::int64_t ran_ns) noexcept {
    watch_the_watcher(ran_ns);
    const EmergencyStop::State state = stop_.state();
    sources_ = state.sources;
    if (state.presses == presses_seen_) return false;
    presses_seen_ = state.presses;
    return true;
  }
  /// Tells whether a Clear must be refused: a source was active at the last look.
  [[nodiscard]] bool forbids_clear() const noexcept { return sources_ != 0; }

  /// Returns the sources active at the last look.
  [[nodiscard]] std::uint32_t sources() const noexcept { return sources_; }

 private:
  /// Detects a stall of the watching thread. A thread once found stalled stays so until it looks.
  void watch_the_watcher(std::int64_t ran_ns) noexcept {
    const std::uint32_t beats = stop_.beats();
    if (beats != beats_) {
      beats_ = beats;
      silent_ns_ = 0;
      stop_.set(StopSource::kWatcher, false);
    } else if (beats != 0) {
      silent_ns_ += ran_ns;
      if (silent_ns_ > kWatcherSilent_ns) stop_.set(StopSource::kWatcher, true);
    }
  }

  EmergencyStop& stop_;
  std::uint32_t sources_{0};
  std::uint32_t presses_seen_{0};
  std::uint32_t beats_;
  std::int64_t silent_ns_{0};
};

}  // namespace corbot::rt
