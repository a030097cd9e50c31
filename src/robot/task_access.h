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

/// The real-time task that a call works with. A command that it hands over is for this task and no later one.
struct LivingTask {
  std::shared_ptr<ServantChannel> channel;  ///< never null
  std::uint64_t incarnation{};

  [[nodiscard]] const TaskSegment& segment() const noexcept { return channel->task(); }
  [[nodiscard]] ServantSegment& own() const noexcept { return channel->own(); }
  /// Number of the last stop that is known.
  [[nodiscard]] std::uint64_t stops() const noexcept { return channel->stops(); }
};

/// Waiting for the real-time task. Any number of threads wait on a condition of this process, which the link's
/// one thread signals; only that thread is woken by the task. Thread-safe; what fails throws CallError.
class TaskAccess {
 public:
  /// Both outlive this.
  TaskAccess(const Link& link, const TaskWatch& watch) : link_(link), watch_(watch) {}

  /// What the servant before this one has left is taken over.
  [[nodiscard]] bool has_inherited() const noexcept { return link_.has_been_attached(); }
  /// A task is connected, and its cycle has run; else not ready, with the cause.
  [[nodiscard]] LivingTask connected() const;
  /// And its cycle advances.
  [[nodiscard]] LivingTask living() const;
  /// Not ready when that task is gone or frozen by now, or the robot is being closed.
  void check(const LivingTask& task) const;
  [[nodiscard]] bool is_living(const LivingTask& task) const;
  /// Why that task is not living.
  [[nodiscard]] std::string cause() const;

  /// Waits until `done` holds for the newest snapshot; not ready when the task dies or freezes, the robot is
  /// closed, or after `seconds`. While it is wanted.
  void await(const LivingTask& task, double seconds, const std::string& what,
             const std::function<bool(const Snapshot&)>& done, const Wanted& wanted = {}) const;
  /// Waits until the task has read the flags as they are now, so that what a client reads next agrees.
  void await_seen(const LivingTask& task, double seconds, const std::string& what,
                  const Wanted& wanted = {}) const;

  /// How often notify() was called. To be read before what is waited for is looked at.
  [[nodiscard]] std::uint64_t changes() const;
  /// Until it was called again, for a short while at most: what changes each cycle is not signalled.
  void wait_change(std::uint64_t seen) const;
  void notify();
  /// Every wait ends, for good.
  void close();
  [[nodiscard]] bool is_closing() const noexcept { return closing_; }

 private:
  const Link& link_;
  const TaskWatch& watch_;
  mutable std::mutex mutex_;  // of the count
  mutable std::condition_variable changed_;
  std::uint64_t changes_{0};
  std::atomic<bool> closing_{false};
};

}  // namespace corbot
