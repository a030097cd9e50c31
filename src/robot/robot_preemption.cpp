// SPDX-License-Identifier: Apache-2.0
// The functions of Robot that work by flags in the segment instead of the queue of motions.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "robot/robot.h"

namespace corbot {
namespace {

constexpr double kSettle_s =
    10.0;  // for actions that the task completes at once, or as fast as the arm's limits allow
constexpr std::chrono::seconds kReportsRead{1};

/// Waits for a stop or a hold that has been counted. If completion is not confirmed, the error says that the
/// stop is counted.
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
  // All numbers up to this one were planned before this Stop.
  const std::uint64_t last = link_.own().next_command_id.load(std::memory_order_acquire) - 1;
  own_stops_.fetch_add(1, std::memory_order_acq_rel);
  return {1, link_.request_stop(), last, hold};
}

void Robot::await_stop(const LivingTask& task, const corbot_counted_stop& stop, const Wanted& wanted) {
  const auto is_done = [&](const Snapshot& now) { return !is_earlier_stop(now.stops_done, stop.number); };
  task_.await(task, kSettle_s, "a Stop", is_done, wanted);
  // The verdicts are out, but the link's thread may not have read them yet. A client that reads the state or
  // a ticket after Stop must find the result of the Stop.
  tickets_.wait_ended(0, stop.last, kReportsRead);
}

/// Waits for a counted stop. The task at the time of the count may be gone; its last snapshot counts.
void Robot::await_counted(const corbot_counted_stop& stop, const Wanted& wanted) {
  Snapshot last{};
  if (!link_.alive() && link_.snapshot(last) && !is_earlier_stop(last.stops_done, stop.number)) return;
  await_stop(task_.connected(), stop, wanted);
}

void Robot::stop(const corbot_counted_stop& counted, const Wanted& wanted) {
  // A frozen task finds the request when it resumes. The error below says that the stop is not carried out
  // yet.
  if (counted.counted != 0) return confirm("stop", [&] { await_counted(counted, wanted); });
  const LivingTask task = task_.connected();
  const corbot_counted_stop stop = count_now(0);
  confirm("stop", [&] { await_stop(task, stop, wanted); });
}

void Robot::request_stop(const corbot_counted_stop& counted) {
  corbot_counted_stop stop = counted;
  if (counted.counted == 0) {
    (void)task_.connected();  // refuses without a task
    stop = count_now(0);
  }
  const std::lock_guard lock(requested_mutex_);
  // A stop that was counted earlier may arrive here later.
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

/// Counts the hold before the stop. The task therefore sees the hold before it begins any motion that was
/// planned after the stop, see HoldLatch.
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

/// Records that a Clear ended all holds that the task had carried out by then. Another Clear may have
/// recorded a higher count.
void Robot::set_holds_cleared(std::uint64_t count) {
  std::atomic<std::uint64_t>& holds = link_.own().control.holds_cleared;
  std::uint64_t cleared = holds.load(std::memory_order_relaxed);
  while (cleared < count && !holds.compare_exchange_weak(cleared, count)) {
  }
}

/// `was_counted`: the hold was counted before, and its alarm may already exist without the name.
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

/// Stops the arm when control ends. A lost task moves nothing; a frozen one finds the stop when it resumes.
std::string Robot::end_control(const Control::Ending& ending) noexcept {
  std::string failure = "no memory";  // short enough to need no allocation
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
      record({ending.who, "", "the lease has run out", 0,
              failure.empty() ? "the arm was stopped"
                              : "the servant cannot confirm that the arm has stopped: " + failure});
    }
  } catch (const std::exception&) {
    // The entry matters less than the stop.
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

void Robot::clear(const Wanted& wanted, std::uint64_t arrival) {
  const LivingTask task = task_.living();
  const auto refuse_for_a_later_hold = [&] {
    if (view_.held() && arrival != 0 && task.stops() != arrival)
      throw not_ready("a stop came after this Clear; call again");
  };
  refuse_for_a_later_hold();
  if (view_.held()) {
    const auto is_over = [this](const Snapshot& now) {
      return now.state == RtState::kError || !view_.held();
    };
    task_.await(task, kSettle_s, "a StopAndHold", is_over, wanted);
  }
  // The task refuses a Clear while the arm decelerates because of a fault.
  const auto is_at_rest = [](const Snapshot& now) { return (now.flags & kSnapshotFaultStop) == 0; };
  task_.await(task, kSettle_s, "the end of a fault's ramp", is_at_rest, wanted);
  refuse_for_a_later_hold();  // it may have come during these waits
  if (view_.snapshot().state != RtState::kError) return;
  const std::uint64_t count = task.own().control.clear_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  Snapshot now{};
  const auto is_done = [&](const Snapshot& snapshot) {
    now = snapshot;
    return snapshot.clears_done >= count;
  };
  task_.await(task, kSettle_s, "a Clear", is_done, wanted);
  if (now.state == RtState::kError) {
    await_reports(clears_drained_, count, task, wanted);  // they may include the cause
    throw not_ready(view_.error_cause());
  }
  set_holds_cleared(now.holds_done);
  // The client's next read shows no alarm that this Clear has ended, and every alarm raised since.
  await_reports(clears_reported_, count, task, wanted);
}

/// Waits until `clears` has reached `count`, or until the bound for reading the task's reports has passed.
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
