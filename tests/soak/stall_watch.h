// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// Notices when the machine stands still, or gives nobody its processor: a thread that sleeps 10 ms at a time.
class StallWatch {
 public:
  StallWatch() : thread_([this] { run(); }) {}
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;
  ~StallWatch() {
    end_ = true;
    thread_.join();
  }
  [[nodiscard]] std::vector<Interval> stalls() const {
    const std::lock_guard lock(mutex_);
    return stalls_;
  }

 private:
  void run() {
    constexpr std::int64_t kLook_ns = 10'000'000;
    constexpr std::int64_t kLate_ns = 50'000'000;
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
  std::thread thread_;
};

}  // namespace corbot::soak
