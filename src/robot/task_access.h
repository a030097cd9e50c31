// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "robot/link.h"
#include "robot/task_watch.h"
#include "robot/wanted.h"

namespace corbot {

/// The real-time task that a call works with. Commands that the call hands over are for this task and no
/// later one.
struct LivingTask {
  std::shared_ptr<ServantChannel> channel;  ///< never null
  std::uint64_t incarnation{};

  [[nodiscard]] const TaskSegment& segment() const noexcept { return channel->task(); }
  [[nodiscard]] ServantSegment& own() const noexcept { return channel->own(); }
  /// Returns the number of the last stop that is known.
  [[nodiscard]] std::uint64_t stops() const noexcept { return channel->stops(); }
};

/// Waits for the real-time task. Any number of threads wait on a condition variable of this process, which
/// the link's thread signals. The task wakes only that thread. Thread-safe; failures throw CallError.
class TaskAccess {
 public:
  /// Both arguments outlive this.
  TaskAccess(const Link& link, const TaskWatch& watch) : link_(link), watch_(watch) {}

  /// Returns true if the previous servant's state is taken over.
  [[nodiscard]] bool has_inherited() const noexcept { return link_.has_been_attached(); }
  /// Returns the task if one is connected and its cycle has run; else throws not_ready with the cause.
  [[nodiscard]] LivingTask connected() const;
  /// Returns the task like connected() if its cycle also advances; else throws not_ready.
  [[nodiscard]] LivingTask living() const;
  /// Throws not_ready if that task is gone or frozen by now, or the robot is shutting down.
  void check(const LivingTask& task) const;
  [[nodiscard]] bool is_living(const LivingTask& task) const;
  /// Returns why that task is not living.
  [[nodiscard]] std::string cause() const;

  /// Waits until `done` holds for the newest snapshot. Throws not_ready if the task dies or freezes, the
  /// robot shuts down, or `seconds` have passed. `wanted` is the abort check.
  void await(const LivingTask& task, double seconds, const std::string& what,
             const std::function<bool(const Snapshot&)>& done, const Wanted& wanted = {}) const;
  /// Waits until the task has read the present flags, so that a client's next read agrees with them.
  void await_seen(const LivingTask& task, double seconds, const std::string& what,
                  const Wanted& wanted = {}) const;

  /// Returns the number of notify() calls. To be read before the condition that the caller waits for.
  [[nodiscard]] std::uint64_t changes() const;
  /// Waits for the next notify(), briefly at most: values that change in each cycle are not signalled.
  void wait_change(std::uint64_t seen) const;
  void notify();
  /// Ends every wait, for good.
  void close();
  [[nodiscard]] bool is_closing() const noexcept { return closing_; }

 private:
  const Link& link_;
  const TaskWatch& watch_;
  mutable std::mutex mutex_;  // guards changes_
  mutable std::condition_variable changed_;
  std::uint64_t changes_{0};
  std::atomic<bool> closing_{false};
};

}  // namespace corbot
