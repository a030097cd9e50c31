// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/watchdog_logic.h"

namespace corbot::rt {

void WatchdogLogic::watch(std::int64_t now_ns, const CycleView& view) noexcept {
  own_gap_ns_ = is_first_ ? 0 : now_ns - own_at_ns_;
  own_at_ns_ = now_ns;
  if (is_first_) cycle_at_ns_ = bus_at_ns_ = bad_at_ns_ = now_ns;
  if (view.is_known && view.cycle != cycle_) {
    cycle_at_ns_ = now_ns;
    has_advanced_ = !is_first_;
    cycle_ = view.cycle;
  }
  if (view.bus_beats != bus_beats_) bus_at_ns_ = now_ns;
  bus_beats_ = view.bus_beats;
  is_first_ = false;
}

const char* WatchdogLogic::stale(std::int64_t now_ns) const noexcept {
  if (own_gap_ns_ > stale_ns_) return "the thread that watches the lines stood still";
  if (now_ns - cycle_at_ns_ > stale_ns_) return "the cycle stood still";
  if (bus_beats_ != 0 && now_ns - bus_at_ns_ > stale_ns_) return "the device's thread stood still";
  return nullptr;
}

void WatchdogLogic::trip() noexcept {
  is_tripped_ = awaits_off_ = true;
  is_running_ = level_ = false;
  cause_ = "its line could not be switched";
  bad_at_ns_ = own_at_ns_;
}

bool WatchdogLogic::step(std::int64_t now_ns, bool may_run, const CycleView& view) noexcept {
  watch(now_ns, view);
  const char* const cause = stale(now_ns);
  if (cause != nullptr) {
    bad_at_ns_ = now_ns;
    if (is_running_) {
      is_tripped_ = awaits_off_ = true;
      cause_ = cause;
    }
  } else if (is_tripped_ && now_ns - bad_at_ns_ >= kRecovered_ns) {
    is_tripped_ = false;
  }
  awaits_off_ = awaits_off_ && may_run;
  const bool was_running = is_running_;
  is_running_ = may_run && has_advanced_ && cause == nullptr && !is_tripped_ && !awaits_off_;
  if (!is_running_) return level_ = false;
  if (!was_running || now_ns >= due_ns_) {
    level_ = !level_;
    due_ns_ = now_ns + period_ns_;  // never two changes in one period
  }
  return level_;
}

}  // namespace corbot::rt
