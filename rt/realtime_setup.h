// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::rt {

struct RealtimeSettings {
  int priority{80};  ///< SCHED_FIFO, 1 … 98
  int cpu{-1};       ///< that the calling thread is bound to; −1: any
};

/// What became of it. Each failure is a sentence with what to do about it.
struct RealtimeResult {
  bool scheduled{false};     ///< SCHED_FIFO at the priority asked for
  bool locked{false};        ///< memory locked
  bool bounded{false};       ///< a real-time thread that computes without end is ended by the kernel
  bool latency_held{false};  ///< the CPU is kept out of deep sleep; a wish, not a condition
  std::vector<std::string> failures;
  [[nodiscard]] bool realtime() const noexcept { return scheduled && locked; }
};

/// Set-up only. Makes the calling thread a real-time one: locks memory, touches the stack that the cycle may
/// use, keeps the CPU out of deep sleep while `latency_fd` is open (−1: not permitted), binds to a CPU,
/// bounds what a real-time thread may compute at a stretch, takes SCHED_FIFO. Never throws for a lacking
/// privilege.
[[nodiscard]] RealtimeResult make_realtime(const RealtimeSettings& settings, int& latency_fd);

}  // namespace corbot::rt
