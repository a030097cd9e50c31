// SPDX-License-Identifier: Apache-2.0
#include "robot/task_access.h"

#include <fmt/format.h>

#include "robot/call_error.h"

namespace corbot {
namespace {

constexpr std::chrono::milliseconds kPoll{10};

}  // namespace

LivingTask TaskAccess::connected() const {
  LivingTask task{link_.channel(), link_.incarnation()};
  if (!task.channel || task.incarnation == 0) throw not_ready(link_.cause());
  return task;
}

LivingTask TaskAccess::living() const {
  LivingTask task = connected();
  if (watch_.is_frozen()) throw not_ready(watch_.cause());
  return task;
}

bool TaskAccess::is_living(const LivingTask& task) const {
  return link_.incarnation() == task.incarnation && link_.channel() == task.channel;
}

std::string TaskAccess::cause() const {
  return link_.alive() ? "the real-time task was restarted meanwhile; call again" : link_.cause();
}

void TaskAccess::check(const LivingTask& task) const {
  if (!is_living(task)) throw not_ready(cause());
  if (watch_.is_frozen()) throw not_ready(watch_.cause());
  if (closing_) throw not_ready("the servant is shutting down");
}

void TaskAccess::await(const LivingTask& task, double seconds, const std::string& what,
                       const std::function<bool(const Snapshot&)>& done, const Wanted& wanted) const {
  Patience patience{std::chrono::duration<double>(seconds)};
  for (;;) {
    const bool is_last = patience.is_over();
    const std::uint64_t seen = changes();
    Snapshot now{};
    if (task.segment().snapshot.load(now) && done(now)) return;
    if (!is_living(task)) throw not_ready(cause());
    if (watch_.is_frozen()) throw not_ready(watch_.cause());
    if (closing_) throw not_ready("the servant is shutting down");
    if (is_last) throw not_ready(fmt::format("{} did not end in {} s", what, seconds));
    corbot::check(wanted);
    wait_change(seen);
  }
}

void TaskAccess::await_seen(const LivingTask& task, double seconds, const std::string& what,
                            const Wanted& wanted) const {
  Snapshot before{};
  if (!last_snapshot(task.segment(), before)) return;
  // The cycle after `before` may have read the flags before they were written; the cycle after that reads
  // them as written.
  const auto is_later = [&](const Snapshot& now) {
    return now.incarnation != before.incarnation || now.cycle >= before.cycle + 2;
  };
  await(task, seconds, what, is_later, wanted);
}

std::uint64_t TaskAccess::changes() const {
  const std::lock_guard lock(mutex_);
  return changes_;
}

void TaskAccess::wait_change(std::uint64_t seen) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kPoll, [&] { return changes_ != seen || closing_; });
}

void TaskAccess::notify() {
  {
    const std::lock_guard lock(mutex_);
    ++changes_;
  }
  changed_.notify_all();
}

void TaskAccess::close() {
  closing_ = true;
  notify();
}

}  // namespace corbot
