// SPDX-License-Identifier: Apache-2.0
#include "rt/threads/thread_priority.h"

#include <pthread.h>
#include <sched.h>

#include <cerrno>
#include <cstddef>

namespace corbot::rt {

int set_fifo_priority(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
}

int bind_to_cpu(int cpu) noexcept {
  if (cpu < 0 || cpu >= CPU_SETSIZE) return EINVAL;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(cpu), &set);
  return ::pthread_setaffinity_np(::pthread_self(), sizeof(set), &set);
}

}  // namespace corbot::rt
