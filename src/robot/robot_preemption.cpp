// SPDX-License-Identifier: Apache-2.0
// Of Robot: what works by flags in the segment, beside the queue of motions.
#include <fmt/format.h>

#include <utility>

#include "robot/robot.h"

namespace corbot {
namespace {

constexpr double kSettle_s = 10.0;  // for what the task does at once, or as fast as the arm's limits allow
constexpr std::chrono::seconds kReportsRead{1};

/// Waits for a stop or a hold that has been counted; who does not hear that it is carried out hears that.
template <class Await>
void confirm(const char* what, Await&& await) {
  try {
    await();
  } catch (const CallError& refused) {
    if (refused.error.status != CORBOT_NOT_READY) throw;
    throw not_ready(
        fmt::format("{}; the {} is counted, and takes effect when a task runs: until then only "
                    "what is wired beside corbot stops the arm",
                    refused.error.text, what));
  }
}

}  // namespace

Robot::CountedStop Robot::count_stop(const LivingTask& task) {
  // Every number up to here was planned before this Stop.
  const std::uint64_t last = task.own().next_command_id.load(std::memory_order_acquire) - 1;
  own_stops_.fetch_add(1, std::memory_order_acq_rel);
  return {task.channel->request_stop(), last};
}

void Robot::await_stop(const LivingTask& task, const CountedStop& stop, const Wanted& wanted) {
  const auto is_done = [&](const Snapshot& now) { return !is_earlier_stop(now.stops_done, stop.count); };
  task_.await(task, kSettle_s, "a Stop", is_done, wanted);
  // The verdicts are out, but the link's thread may not have read them yet: a client that reads the state or
  // a ticket after Stop has returned must find what Stop did.
  tickets_.wait_ended(0, stop.last, kReportsRead);
}

void Robot::stop(const Wanted& wanted) {
  // A frozen task finds the request when it goes on; the caller hears below that it is not carried out yet.
  const LivingTask task = task_.connected();
  const CountedStop stop = count_stop(task);
  confirm("stop", [&] { await_stop(task, stop, wanted); });
}

void Robot::request_stop() {
  const LivingTask task = task_.connected();
  const CountedStop stop = count_stop(task);
  const std::lock_guard lock(requested_mutex_);
  requested_ = stop;
}

void Robot::request_stop_and_hold(std::string by) {
  const std::uint64_t hold = count_hold(std::move(by));
  {
    const std::lock_guard lock(requested_mutex_);
    requested_hold_ = hold;
  }
  request_stop();
}

void Robot::await_requested_stops(bool hold) {
  confirm(hold ? "hold" : "stop", [&] { await_all_requested(hold); });
}

void Robot::await_all_requested(bool hold) {
  const LivingTask task = task_.connected();
  CountedStop newest{};
  std::uint64_t newest_hold = 0;
  {
    const std::lock_guard lock(requested_mutex_);
    newest = requested_;
    newest_hold = requested_hold_;
  }
  await_stop(task, newest, {});
  if (hold) await_hold(newest_hold);
}

/// Before the stop: what is planned after that stop is not begun before the task has seen this, see HoldLatch.
std::uint64_t Robot::count_hold(std::string by) {
  set_held_by(std::move(by));
  return link_.own().control.hold_count.fetch_add(1, std::memory_order_acq_rel) + 1;
}

void Robot::await_hold(std::uint64_t count) {
  task_.await(task_.connected(), kSettle_s, "a StopAndHold",
              [&](const Snapshot& now) { return now.holds_done >= count; });
}

void Robot::stop_and_hold(std::string by) {
  const std::uint64_t count = count_hold(std::move(by));
  confirm("hold", [&] {
    const LivingTask task = task_.connected();
    await_stop(task, count_stop(task), {});
    await_hold(count);
  });
}

/// A Clear has taken back what the task had carried out by then; another may have got further.
void Robot::set_holds_cleared(std::uint64_t count) {
  std::atomic<std::uint64_t>& holds = link_.own().control.holds_cleared;
  std::uint64_t cleared = holds.load(std::memory_order_relaxed);
  while (cleared < count && !holds.compare_exchange_weak(cleared, count)) {
  }
}

void Robot::set_held_by(std::string by) {
  const std::lock_guard lock(held_by_mutex_);
  held_by_ = std::move(by);
  HoldRecord record{};
  copy_text(held_by_, record.by.data(), record.by.size());
  link_.own().state.hold.store(record);
}

std::string Robot::held_alarm_text(const AlarmEvent& alarm) const {
  const std::lock_guard lock(held_by_mutex_);
  const std::string text = alarm_text(alarm, {});
  return held_by_.empty() ? text : text + ", asked for by " + held_by_;
}

/// A task that is gone moves nothing; a frozen one finds the stop when it goes on.
std::string Robot::end_control(const Control::Ending& ending) noexcept {
  std::string failure = "no memory";  // short enough to need none
  try {
    try {
      stop(ending.wanted);
      failure.clear();
    } catch (const CallError& failed) {
      failure = failed.error.text;
    } catch (const std::exception& failed) {
      failure = failed.what();
    }
    if (!ending.is_released) {
      record(
          {ending.who, "", "the lease has run out", 0,
           failure.empty() ? "the arm was stopped" : "it is not known that the arm has stopped: " + failure});
    }
  } catch (const std::exception&) {
    // The entry is worth less than the stop.
  }
  return failure;
}

void Robot::pause(bool on, const Wanted& wanted) {
  const LivingTask task = task_.living();
  task.own().control.pause.store(on ? 1 : 0, std::memory_order_relaxed);
  task_.await_seen(task, kSettle_s, "a Pause", wanted);
}

void Robot::set_override(double percent, const Wanted& wanted) {
  const double ratio = checked_percent("percent", percent);
  const LivingTask task = task_.living();
  task.own().control.override_ratio.store(ratio, std::memory_order_relaxed);
  task_.await_seen(task, kSettle_s, "an Override", wanted);
}

void Robot::clear(const Wanted& wanted) {
  const LivingTask task = task_.living();
  if (view_.held()) {
    const auto is_over = [this](const Snapshot& now) {
      return now.state == RtState::kError || !view_.held();
    };
    task_.await(task, kSettle_s, "a StopAndHold", is_over, wanted);
  }
  // The task refuses to clear an arm that a fault is slowing down.
  const auto is_at_rest = [](const Snapshot& now) { return (now.flags & kSnapshotFaultStop) == 0; };
  task_.await(task, kSettle_s, "the end of a fault's ramp", is_at_rest, wanted);
  if (view_.snapshot().state != RtState::kError) return;
  const std::uint64_t count = task.own().control.clear_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  Snapshot now{};
  const auto is_done = [&](const Snapshot& snapshot) {
    now = snapshot;
    return snapshot.clears_done >= count;
  };
  task_.await(task, kSettle_s, "a Clear", is_done, wanted);
  if (now.state == RtState::kError) {
    await_reports(clears_drained_, count, task, wanted);  // among them may be why
    throw not_ready(view_.error_cause());
  }
  set_holds_cleared(now.holds_done);
  // What the client reads next has no alarm that this Clear has taken back, and every one that came since.
  await_reports(clears_reported_, count, task, wanted);
}

/// Until `clears` has reached `count`, as far as the task's reports are read in time.
void Robot::await_reports(const std::atomic<std::uint64_t>& clears, std::uint64_t count,
                          const LivingTask& task, const Wanted& wanted) {
  for (Patience patience(kReportsRead);;) {
    const bool is_last = patience.is_over();
    const std::uint64_t seen = task_.changes();
    if (clears >= count || is_last) return;
    task_.check(task);
    check(wanted);
    task_.wait_change(seen);
  }
}

}  // namespace corbot
