// SPDX-License-Identifier: Apache-2.0
#include "fault/jump_watch.h"

#include <cmath>
#include <ctime>

#include <fmt/core.h>

namespace corbot::test {

JumpWatch::JumpWatch(const std::string& robot, const ArmModel& arm)
    : robot_(robot),
      channel_(std::make_shared<Observer>(Observer::of(robot))),
      arm_(arm),
      thread_([this] { follow(); }) {}

void JumpWatch::finish() {
  end_ = true;
  if (thread_.joinable()) thread_.join();
}

Snapshot JumpWatch::newest() const {
  Snapshot snapshot{};
  (void)last_snapshot(channel()->task(), snapshot);
  return snapshot;
}

std::shared_ptr<Observer> JumpWatch::channel() const {
  const std::lock_guard lock(mutex_);
  return channel_;
}

/// Each task has a trace of its own; the comparison goes on from one to the next.
void JumpWatch::follow() {
  while (!end_) {
    follow_task(*channel());
    try {
      auto next = std::make_shared<Observer>(Observer::of(robot_));
      const std::lock_guard lock(mutex_);
      channel_ = std::move(next);
    } catch (const SegmentError&) {
      const timespec pause{0, 2'000'000};
      ::nanosleep(&pause, nullptr);
    }
  }
}

void JumpWatch::follow_task(const Observer& channel) {
  const Trace& trace = channel.task().trace;
  if (task_ != channel.task().header.id) next_ = 0;
  task_ = channel.task().header.id;
  for (bool lives = true; lives && !end_;) {
    lives = channel.task_alive();
    std::uint64_t& next = next_;
    Snapshot& last = last_;
    bool& have_last = have_last_;
    const std::uint64_t end = trace.next();
    if (end - next > Trace::capacity()) {  // fell behind: the comparison begins anew
      next = end - Trace::capacity() / 2;
      have_last = false;
    }
    for (; next < end; ++next) {
      Snapshot now{};
      if (!trace.read(next, now)) {
        // A task that was killed while it wrote leaves one slot unreadable; the comparison goes on across
        // it. But not across what has been overwritten before it was read.
        if (trace.next() - next >= Trace::capacity()) have_last = false;
        continue;
      }
      if (have_last) compare(last, now);
      last = now;
      have_last = true;
      ++cycles_;
      if (now.state == RtState::kMoving) ++moving_;
    }
    const timespec pause{0, 2'000'000};
    ::nanosleep(&pause, nullptr);
  }
}

void JumpWatch::compare(const Snapshot& last, const Snapshot& now) {
  const double period_s = static_cast<double>(arm_.period_ns) * 1e-9;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const double step = std::abs(now.position_q[i] - last.position_q[i]);
    // Two cycles' travel: one slot of a killed task may be unreadable.
    const double allowed = 2.0 * arm_.joints[i].speed_q_s * period_s * (1.0 + 1e-6) + 1e-9;
    if (step <= allowed) continue;
    if (jumps_++ == 0) {
      first_jump_ =
          fmt::format("joint {} by {} rad, allowed {}, cycle {} incarnation {} to cycle {} incarnation {}", i,
                      step, allowed, last.cycle, last.incarnation, now.cycle, now.incarnation);
    }
  }
}

}  // namespace corbot::test
