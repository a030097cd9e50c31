// SPDX-License-Identifier: Apache-2.0
#include "robot/self_check.h"

#include <utility>

namespace corbot {

void SelfCheck::start(std::function<bool()> answers) {
  answers_ = std::move(answers);
  passed_at_.store(Clock::now().time_since_epoch().count(), std::memory_order_release);
  started_.store(true, std::memory_order_release);
  thread_ = std::thread([this] { run(); });
}

void SelfCheck::close() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool SelfCheck::passes() const noexcept {
  if (!is_started()) return true;
  const Clock::time_point passed{Clock::duration(passed_at_.load(std::memory_order_acquire))};
  return Clock::now() - passed < kHolds;
}

void SelfCheck::run() {
  std::unique_lock lock(mutex_);
  while (!end_) {
    lock.unlock();
    if (answers_()) passed_at_.store(Clock::now().time_since_epoch().count(), std::memory_order_release);
    lock.lock();
    end_requested_.wait_for(lock, kInterval, [this] { return end_; });
  }
}

}  // namespace corbot
