// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::rt {

struct RealtimeSettings {
  int priority{80};  ///< SCHED_FIFO, 1 … 98
  int cpu{-1};       ///< CPU to which the calling thread is bound; −1: any
};

/// The result of the set-up. Each failure is a sentence that names the remedy.
struct RealtimeResult {
  bool scheduled{false};     ///< SCHED_FIFO at the requested priority
  bool locked{false};        ///< memory locked
  bool bounded{false};       ///< the kernel ends a real-time thread that computes without end
  bool latency_held{false};  ///< the CPU is kept out of deep sleep; desirable, not required
  std::vector<std::string> failures;
  [[nodiscard]] bool realtime() const noexcept { return scheduled && locked; }
};

/// Limits the stacks of threads that start later to 1 MB, before the first one starts. Locked memory has each
/// page of a stack from its start, and the usual stack has 8 MB.
void limit_thread_stacks();

/// Set-up only. Makes the calling thread a real-time thread. It locks memory, and touches the stack that the
/// cycle may use. It keeps the CPU out of deep sleep while `latency_fd` is open (−1: not permitted). It binds
/// the thread to a CPU, bounds its uninterrupted computing time, and takes SCHED_FIFO. It never throws for a
/// missing privilege.
[[nodiscard]] RealtimeResult make_realtime(const RealtimeSettings& settings, int& latency_fd);

}  // namespace corbot::rt
