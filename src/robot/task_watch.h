// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "corbot/running_time.h"
#include "notify/service_notifier.h"
#include "robot/alarm_log.h"
#include "robot/link.h"

namespace corbot {

/// Whether a counter that another process increments has stood still, in this process's running time.
class Progress {
 public:
  using Clock = RunningTime::Clock;
  static constexpr std::chrono::milliseconds kLook{20};
  static constexpr std::chrono::milliseconds kLongestLook{40};

  /// Frozen: the counter has stood still for as long as this.
  explicit Progress(Clock::duration frozen_after) : frozen_after_(frozen_after) {}

  /// The counter as it is at `now`. Returns is_frozen().
  bool see(std::uint64_t counter, Clock::time_point now);
  /// Nothing is to be watched; the next look begins anew.
  void reset() { has_counter_ = false; }

  [[nodiscard]] bool is_frozen() const { return has_counter_ && still_.passed() >= frozen_after_; }
  /// Of the last look at which the counter had changed.
  [[nodiscard]] Clock::time_point changed_at() const { return changed_at_; }

 private:
  Clock::duration frozen_after_;
  bool has_counter_{false};
  std::uint64_t counter_{};
  RunningTime still_{kLongestLook, {}};
  Clock::time_point changed_at_{};
};

/// Liveness between servant and real-time task, a thread of its own. Looks whether the task's cycle number
/// advances; where it stands still there is an alarm, active until it advances again. And raises the
/// servant's beat, by which the task knows that the servant responds, and reports to the supervisor of this
/// process, as long as `responds` returns true.
class TaskWatch {
 public:
  struct Hooks {
    std::function<bool()> is_ready;  ///< calls are served: to the supervisor
    std::function<bool()> responds;  ///< proves that calls are served; where it blocks, the beat stands still
    std::function<void(bool frozen)> on_change;  ///< from the thread
  };

  /// Link and log outlive this. `frozen_after_ns`: see Profile.
  TaskWatch(const Link& link, AlarmLog& alarms, std::int64_t frozen_after_ns, Hooks hooks);
  TaskWatch(const TaskWatch&) = delete;
  TaskWatch& operator=(const TaskWatch&) = delete;
  ~TaskWatch() { close(); }

  void start();
  void close();

  /// The task is there, and its cycle number stands still.
  [[nodiscard]] bool is_frozen() const noexcept { return frozen_.load(std::memory_order_acquire); }
  /// What is_frozen() means, and since when.
  [[nodiscard]] std::string cause() const;

 private:
  void run();
  void look();
  void set_frozen(bool frozen);
  void report();

  const Link& link_;
  AlarmLog& alarms_;
  const Hooks hooks_;
  Progress progress_;           // the thread's own
  ServiceNotifier supervisor_;  // likewise
  std::atomic<bool> frozen_{false};
  std::atomic<Progress::Clock::rep> changed_at_{0};

  std::mutex mutex_;  // of end_
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot
