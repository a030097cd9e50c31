// SPDX-License-Identifier: Apache-2.0
#include "robot/self_check.h"

#include <pthread.h>

#include <utility>

namespace corbot {

void SelfCheck::start(std::function<bool()> answers) {
  answers_ = std::move(answers);
  answers_count_.fetch_add(1, std::memory_order_release);  // bridges the time to the first answer
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

bool SelfCheck::passes() {
  if (!is_started()) return true;
  const std::lock_guard lock(look_mutex_);
  const RunningTime::Clock::time_point now = RunningTime::Clock::now();
  const std::uint64_t answers = answers_count_.load(std::memory_order_acquire);
  if (answers != seen_) {
    seen_ = answers;
    since_answer_.restart(now);
  }
  return since_answer_.look(now) < kHolds;
}

void SelfCheck::run() {
  ::pthread_setname_np(::pthread_self(), "robot.check");
  std::unique_lock lock(mutex_);
  while (!end_) {
    lock.unlock();
    if (answers_()) answers_count_.fetch_add(1, std::memory_order_release);
    lock.lock();
    end_requested_.wait_for(lock, kInterval, [this] { return end_; });
  }
}

}  // namespace corbot
