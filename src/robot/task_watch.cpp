// SPDX-License-Identifier: Apache-2.0
#include "robot/task_watch.h"

#include <fmt/format.h>
#include <pthread.h>

#include <utility>

namespace corbot {

bool Progress::see(std::uint64_t counter, Clock::time_point now) {
  if (!has_counter_ || counter != counter_) {
    has_counter_ = true;
    counter_ = counter;
    still_.restart(now);
    changed_at_ = now;
  } else {
    still_.look(now);
  }
  return is_frozen();
}

TaskWatch::TaskWatch(const Link& link, AlarmLog& alarms, std::int64_t frozen_after_ns, Hooks hooks)
    : link_(link),
      alarms_(alarms),
      hooks_(std::move(hooks)),
      progress_(std::chrono::nanoseconds(frozen_after_ns)) {}

void TaskWatch::start() {
  thread_ = std::thread([this] { run(); });
}

void TaskWatch::close() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::string TaskWatch::cause() const {
  const Progress::Clock::time_point changed{
      Progress::Clock::duration(changed_at_.load(std::memory_order_acquire))};
  const std::chrono::duration<double> age = Progress::Clock::now() - changed;
  return fmt::format("the real-time task does not respond: its last cycle was {:.1f} s ago", age.count());
}

void TaskWatch::run() {
  ::pthread_setname_np(::pthread_self(), "robot.watch");
  std::unique_lock lock(mutex_);
  while (!end_) {
    lock.unlock();
    look();
    if (hooks_.responds()) report();
    lock.lock();
    end_requested_.wait_for(lock, Progress::kLook, [this] { return end_; });
  }
}

void TaskWatch::look() {
  const auto channel = link_.channel();
  Snapshot now{};
  // A task before its first cycle is still approaching its device.
  if (!link_.alive() || !channel || !last_snapshot(channel->task(), now) ||
      now.incarnation != channel->task().incarnation) {
    progress_.reset();
  } else {
    (void)progress_.see(now.cycle, Progress::Clock::now());
  }
  set_frozen(progress_.is_frozen());
}

void TaskWatch::set_frozen(bool frozen) {
  changed_at_.store(progress_.changed_at().time_since_epoch().count(), std::memory_order_release);
  if (frozen == is_frozen()) return;
  // The alarm comes before the state: a client that reads Error finds its cause at once.
  if (frozen)
    alarms_.add(kAlarmTaskFrozen, true, "the real-time task does not respond: its cycle number stands still");
  frozen_.store(frozen, std::memory_order_release);
  if (!frozen) alarms_.deactivate(kAlarmTaskFrozen);
  hooks_.on_change(frozen);
}

void TaskWatch::report() {
  if (hooks_.is_ready()) {
    supervisor_.ready();
    supervisor_.alive();
  }
  // Relaxed: the beat shows only that this thread runs, and orders nothing else.
  if (const auto channel = link_.channel())
    channel->own().control.servant_beat.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace corbot
