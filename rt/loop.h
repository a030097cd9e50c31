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

/// Calls Cycle::step() once a period on an absolute time grid, so that nothing drifts. It skips and counts a
/// missed period: the grid goes on, and there is never a burst of steps. It keeps the histogram of wake-up
/// latencies and publishes the diagnostics every hundred cycles.
class Loop {
 public:
  Loop(Cycle& cycle, TaskSegment& segment, const LoopSettings& settings) noexcept;

  /// Runs until `stop` is set and the arm has come to rest. It makes no allocation and takes no lock. Its
  /// only system calls are clock_nanosleep and the futex that wakes the servant's thread.
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
  bool is_overrun_counted_{false};  ///< the overrun before the next step
  LoopDiagnostics diagnostics_{};
};

/// Returns the bucket of the latency histogram for a latency.
[[nodiscard]] std::size_t latency_bucket(std::int64_t latency_ns) noexcept;

}  // namespace corbot::rt
