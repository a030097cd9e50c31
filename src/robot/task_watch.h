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

/// Detects that a counter of another process has stalled, measured in this process's running time.
class Progress {
 public:
  using Clock = RunningTime::Clock;
  static constexpr std::chrono::milliseconds kLook{20};
  static constexpr std::chrono::milliseconds kLongestLook{40};

  /// `frozen_after`: the counter is frozen when it has stalled for this long.
  explicit Progress(Clock::duration frozen_after) : frozen_after_(frozen_after) {}

  /// Records the counter at `now`. Returns is_frozen().
  bool see(std::uint64_t counter, Clock::time_point now);
  /// Stops watching; the next see() begins anew.
  void reset() { has_counter_ = false; }

  [[nodiscard]] bool is_frozen() const { return has_counter_ && still_.passed() >= frozen_after_; }
  /// Returns the time of the last look at which the counter had changed.
  [[nodiscard]] Clock::time_point changed_at() const { return changed_at_; }

 private:
  Clock::duration frozen_after_;
  bool has_counter_{false};
  std::uint64_t counter_{};
  RunningTime still_{kLongestLook, {}};
  Clock::time_point changed_at_{};
};

/// Liveness between servant and real-time task, in a thread of its own. Watches whether the task's cycle
/// number advances; while it is stalled, an alarm is active. Raises the servant's beat and reports to the
/// supervisor of this process while `responds` returns true. The beat shows the task that the servant
/// responds.
class TaskWatch {
 public:
  struct Hooks {
    std::function<bool()> is_ready;  ///< calls are served; reported to the supervisor
    std::function<bool()> responds;  ///< proves that calls are served; while it blocks, the beat is stalled
    std::function<void(bool frozen)> on_change;  ///< called from the thread
  };

  /// `link` and `alarms` outlive this. `frozen_after_ns`: see Profile.
  TaskWatch(const Link& link, AlarmLog& alarms, std::int64_t frozen_after_ns, Hooks hooks);
  TaskWatch(const TaskWatch&) = delete;
  TaskWatch& operator=(const TaskWatch&) = delete;
  ~TaskWatch() { close(); }

  void start();
  void close();

  /// Returns true if the task is connected and its cycle number is stalled.
  [[nodiscard]] bool is_frozen() const noexcept { return frozen_.load(std::memory_order_acquire); }
  /// Describes the frozen state and how long it has lasted.
  [[nodiscard]] std::string cause() const;

 private:
  void run();
  void look();
  void set_frozen(bool frozen);
  void report();

  const Link& link_;
  AlarmLog& alarms_;
  const Hooks hooks_;
  Progress progress_;           // used by the thread only
  ServiceNotifier supervisor_;  // used by the thread only
  std::atomic<bool> frozen_{false};
  std::atomic<Progress::Clock::rep> changed_at_{0};

  std::mutex mutex_;  // guards end_
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot
