// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/channel/layout.h"
#include "rt/cycle/cycle.h"
#include "rt/cycle/liveness.h"

namespace corbot::rt {

struct LoopSettings {
  std::int64_t period_ns{1'000'000};
  bool realtime{false};
  int priority{0};
};

/// Calls Cycle::step() once a period on an absolute time grid, so that nothing drifts. A period that is
/// missed is skipped and counted: the grid goes on, and there is never a burst of steps. Keeps the histogram
/// of wake-up latencies and publishes the diagnostics every hundred cycles.
class Loop {
 public:
  Loop(Cycle& cycle, TaskSegment& segment, const LoopSettings& settings) noexcept;

  /// Until `stop` is set and the arm has come to rest. No allocation, no lock; sleeps by clock_nanosleep and
  /// wakes the servant's thread by futex, its only system calls.
  void run(const std::atomic<bool>& stop) noexcept;

 private:
  void count_latency(std::int64_t latency_ns) noexcept;
  void skip_overslept(std::int64_t woken_ns) noexcept;
  void watch_suspension(std::int64_t woken_ns) noexcept;
  void count_overrun() noexcept;
  void count_missed(std::int64_t now_ns) noexcept;

  Cycle& cycle_;
  TaskSegment& segment_;
  const LoopSettings settings_;
  std::int64_t due_ns_{0};
  SuspensionWatch suspension_;
  bool is_overrun_counted_{false};  ///< the one before the next step
  LoopDiagnostics diagnostics_{};
};

/// Bucket of the latency histogram that a latency belongs to.
[[nodiscard]] std::size_t latency_bucket(std::int64_t latency_ns) noexcept;

}  // namespace corbot::rt
