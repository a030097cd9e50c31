// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// The presses of the emergency stop, each told once, and what is active of it; and whether the thread that watches the
/// inputs still looks, which counts as a press where it does not. Real-time safe.
class EmergencyStopWatch {
 public:
  /// A watching thread that has not looked for so long, in time that the cycle ran, stands still; from its
  /// start on, so that one that never looks is found too.
  static constexpr std::int64_t kWatcherSilent_ns = 100'000'000;

  explicit EmergencyStopWatch(EmergencyStop& stop) noexcept : stop_(stop), beats_(stop.beats()) {}

  /// Once a step. `ran_ns`: time that has passed, without gaps of this process's own. True for a press that was not seen
  /// before, though it be over.
  [[nodiscard]] bool see(std::int64_t ran_ns) noexcept {
    watch_the_watcher(ran_ns);
    const EmergencyStop::State state = stop_.state();
    sources_ = state.sources;
    if (state.presses == presses_seen_) return false;
    presses_seen_ = state.presses;
    return true;
  }
  /// Whether a Clear is refused for it: one of the sources was active at the last look.
  [[nodiscard]] bool forbids_clear() const noexcept { return sources_ != 0; }

  /// At the last look.
  [[nodiscard]] std::uint32_t sources() const noexcept { return sources_; }

 private:
  /// One that was found still before stays so until it looks.
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
