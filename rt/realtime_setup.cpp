// SPDX-License-Identifier: Apache-2.0
#include "rt/realtime_setup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

constexpr std::size_t kStackBytes = 256 * 1024;
constexpr std::size_t kThreadStackBytes = 1024 * 1024;
constexpr rlim_t kLongestComputing_us = 500'000;

bool lock_memory(RealtimeResult& result) {
  // Pages that malloc has freed stay with the process, so no later use faults them in again.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return true;
  result.failures.push_back(fmt::format(
      "memory cannot be locked ({}): raise 'memlock' in /etc/security/limits.d, or grant CAP_IPC_LOCK",
      std::strerror(errno)));
  return false;
}

/// Touches the stack once, so that the cycle never takes a page fault for it.
void prefault_stack() {
  volatile std::uint8_t stack[kStackBytes];
  for (std::size_t i = 0; i < kStackBytes; i += 4096) stack[i] = 0;
  (void)stack[0];
}

bool limit_latency(int& latency_fd) {
  latency_fd = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  if (latency_fd < 0) return false;
  const std::int32_t microseconds = 0;
  if (::write(latency_fd, &microseconds, sizeof(microseconds)) == sizeof(microseconds)) return true;
  ::close(latency_fd);
  latency_fd = -1;
  return false;
}

void take_cpu(int cpu, RealtimeResult& result) {
  if (cpu < 0) return;
  const int error = bind_to_cpu(cpu);
  if (error == 0) return;
  result.failures.push_back(fmt::format("cannot be bound to CPU {} ({}): choose another 'cpu' in the profile",
                                        cpu, std::strerror(error)));
}

/// Limits the uninterrupted computing time of real-time threads. The kernel then ends the process by SIGXCPU:
/// a thread that spins would otherwise hold its processor for good. The limit is far beyond a cycle's time.
/// It is below the second after which the kernel throttles all real-time threads. The function never raises
/// an existing limit.
bool limit_computing(RealtimeResult& result) {
  rlimit limit{};
  if (getrlimit(RLIMIT_RTTIME, &limit) != 0) return false;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, kLongestComputing_us);
  if (setrlimit(RLIMIT_RTTIME, &limit) == 0) return true;
  result.failures.push_back(
      fmt::format("the computing time of real-time threads cannot be limited ({})", std::strerror(errno)));
  return false;
}

bool set_fifo(int priority, RealtimeResult& result) {
  const int error = set_fifo_priority(priority);
  if (error == 0) return true;
  result.failures.push_back(fmt::format(
      "SCHED_FIFO {} is not permitted ({}): raise 'rtprio' in /etc/security/limits.d, or grant CAP_SYS_NICE",
      priority, std::strerror(error)));
  return false;
}

}  // namespace

void limit_thread_stacks() {
  pthread_attr_t attributes;
  if (pthread_getattr_default_np(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, kThreadStackBytes) == 0)
    (void)pthread_setattr_default_np(&attributes);  // if it fails, threads only lock more memory
  pthread_attr_destroy(&attributes);
}

RealtimeResult make_realtime(const RealtimeSettings& settings, int& latency_fd) {
  RealtimeResult result;
  result.locked = lock_memory(result);
  prefault_stack();
  result.latency_held = limit_latency(latency_fd);
  take_cpu(settings.cpu, result);
  result.bounded = limit_computing(result);
  result.scheduled = set_fifo(settings.priority, result);
  return result;
}

}  // namespace corbot::rt
