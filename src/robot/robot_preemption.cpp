// SPDX-License-Identifier: Apache-2.0
// Of Robot: what works by flags in the segment, beside the queue of motions.
#include <fmt/format.h>

#include <algorithm>
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

std::string asked_for_by(const std::string& alarm, const std::string& who) {
  return who.empty() ? alarm : alarm + ", asked for by " + who;
}

}  // namespace

corbot_counted_stop Robot::count_stop(bool hold) noexcept {
  if (!link_.alive()) return {};
  if (!hold) return count_now(0);
  unnamed_holds_.fetch_add(1);
  return count_now(count_hold());
}

corbot_counted_stop Robot::count_now(std::uint64_t hold) noexcept {
  // Every number up to here was planned before this Stop.
  const std::uint64_t last = link_.own().next_command_id.load(std::memory_order_acquire) - 1;
  own_stops_.fetch_add(1, std::memory_order_acq_rel);
  return {1, link_.request_stop(), last, hold};
}

void Robot::await_stop(const LivingTask& task, const corbot_counted_stop& stop, const Wanted& wanted) {
  const auto is_done = [&](const Snapshot& now) { return !is_earlier_stop(now.stops_done, stop.number); };
  task_.await(task, kSettle_s, "a Stop", is_done, wanted);
  // The verdicts are out, but the link's thread may not have read them yet: a client that reads the state or
  // a ticket after Stop has returned must find what Stop did.
  tickets_.wait_ended(0, stop.last, kReportsRead);
}

/// The task that was there when it was counted may be gone. What that had done counts.
void Robot::await_counted(const corbot_counted_stop& stop, const Wanted& wanted) {
  Snapshot last{};
  if (!link_.alive() && link_.snapshot(last) && !is_earlier_stop(last.stops_done, stop.number)) return;
  await_stop(task_.connected(), stop, wanted);
}

void Robot::stop(const corbot_counted_stop& counted, const Wanted& wanted) {
  // A frozen task finds the request when it goes on; the caller hears below that it is not carried out yet.
  if (counted.counted != 0) return confirm("stop", [&] { await_counted(counted, wanted); });
  const LivingTask task = task_.connected();
  const corbot_counted_stop stop = count_now(0);
  confirm("stop", [&] { await_stop(task, stop, wanted); });
}

void Robot::request_stop(const corbot_counted_stop& counted) {
  corbot_counted_stop stop = counted;
  if (counted.counted == 0) {
    (void)task_.connected();  // refused without one
    stop = count_now(0);
  }
  const std::lock_guard lock(requested_mutex_);
  // One that was counted before another may come here after it.
  if (requested_.counted == 0 || is_earlier_stop(requested_.number, stop.number)) requested_ = stop;
}

void Robot::request_stop_and_hold(std::string by, const corbot_counted_stop& counted) {
  set_held_by(std::move(by), counted.counted != 0);
  const std::uint64_t hold = counted.counted != 0 ? counted.hold : count_hold();
  {
    const std::lock_guard lock(requested_mutex_);
    requested_hold_ = std::max(requested_hold_, hold);
  }
  request_stop(counted);
}

void Robot::await_requested_stops(bool hold) {
  confirm(hold ? "hold" : "stop", [&] { await_all_requested(hold); });
}

void Robot::await_all_requested(bool hold) {
  const LivingTask task = task_.connected();
  corbot_counted_stop newest{};
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
std::uint64_t Robot::count_hold() noexcept {
  return link_.own().control.hold_count.fetch_add(1, std::memory_order_acq_rel) + 1;
}

void Robot::await_hold(std::uint64_t count) {
  task_.await(task_.connected(), kSettle_s, "a StopAndHold",
              [&](const Snapshot& now) { return now.holds_done >= count; });
}

void Robot::stop_and_hold(std::string by, const corbot_counted_stop& counted) {
  set_held_by(std::move(by), counted.counted != 0);
  const std::uint64_t count = counted.counted != 0 ? counted.hold : count_hold();
  confirm("hold", [&] {
    if (counted.counted != 0) {
      await_counted(counted, {});
    } else {
      const LivingTask task = task_.connected();
      await_stop(task, count_now(0), {});
    }
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

/// Where `was_counted`, the hold was counted before, and its alarm may be there without the name.
void Robot::set_held_by(std::string by, bool was_counted) {
  const std::lock_guard lock(held_by_mutex_);
  held_by_ = std::move(by);
  HoldRecord record{};
  copy_text(held_by_, record.by.data(), record.by.size());
  link_.own().state.hold.store(record);
  if (!was_counted) return;
  unnamed_holds_.fetch_sub(1);
  const std::string unnamed = std::exchange(unnamed_alarm_, {});
  if (unnamed.empty() || held_by_.empty()) return;
  alarms_.replace_text(static_cast<std::int32_t>(AlarmCode::kHeld), unnamed, asked_for_by(unnamed, held_by_));
}

void Robot::add_held_alarm(const AlarmEvent& alarm) {
  const std::lock_guard lock(held_by_mutex_);
  const std::string text = alarm_text(alarm, {});
  if (unnamed_holds_.load() == 0) return alarms_.add_once(alarm, asked_for_by(text, held_by_));
  unnamed_alarm_ = text;
  alarms_.add_once(alarm, text);
}

/// A task that is gone moves nothing; a frozen one finds the stop when it goes on.
std::string Robot::end_control(const Control::Ending& ending) noexcept {
  std::string failure = "no memory";  // short enough to need none
  try {
    try {
      stop({}, ending.wanted);
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
