// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "soak/recording.h"

namespace corbot::soak {

inline std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

inline void sleep_ns(std::int64_t ns) {
  const timespec time{ns / 1'000'000'000, ns % 1'000'000'000};
  ::nanosleep(&time, nullptr);
}

/// Notices when the machine stalls, or gives one of its processors to other programs. A thread on each
/// processor sleeps 10 ms at a time. A real-time thread that spins takes a processor from all others for as
/// long.
class StallWatch {
 public:
  StallWatch() {
    cpu_set_t all;
    CPU_ZERO(&all);
    if (::sched_getaffinity(0, sizeof(all), &all) != 0) return;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (CPU_ISSET(cpu, &all)) threads_.emplace_back([this, cpu] { run(cpu); });
    }
  }
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;
  ~StallWatch() {
    end_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  [[nodiscard]] std::vector<Interval> stalls() const {
    const std::lock_guard lock(mutex_);
    return stalls_;
  }

 private:
  void run(int cpu) {
    constexpr std::int64_t kLook_ns = 10'000'000;
    constexpr std::int64_t kLate_ns = 50'000'000;
    cpu_set_t own;
    CPU_ZERO(&own);
    CPU_SET(cpu, &own);
    (void)::pthread_setaffinity_np(::pthread_self(), sizeof(own), &own);
    for (std::int64_t last_ns = now_ns(); !end_;) {
      sleep_ns(kLook_ns);
      const std::int64_t looked_ns = now_ns();
      if (looked_ns - last_ns > kLate_ns) {
        const std::lock_guard lock(mutex_);
        stalls_.push_back({last_ns, looked_ns});
      }
      last_ns = looked_ns;
    }
  }

  mutable std::mutex mutex_;  // of the stalls
  std::vector<Interval> stalls_;
  std::atomic<bool> end_{false};
  std::vector<std::thread> threads_;
};

}  // namespace corbot::soak
