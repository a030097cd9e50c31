// SPDX-License-Identifier: Apache-2.0
#include "robot/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "corbot/channel/alarms.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/units.h"
#include "robot/inherited_state.h"

namespace corbot {
namespace {

constexpr double kSettle_s = 10.0;  // for what the task does at once, or as fast as the arm's limits allow
constexpr std::chrono::seconds kReportsRead{1};

double checked_percent(const std::string& parameter, double percent) {
  if (percent > 0.0 && percent <= 100.0) return percent / 100.0;
  throw bad_argument(parameter, percent, fmt::format("{:.6g} percent, allowed above 0 up to 100", percent));
}

}  // namespace

Robot::Robot(Profile profile, const std::string& name)
    : profile_(std::move(profile)),
      name_(name),
      planner_(profile_.arm),
      link_(name, fingerprint(profile_.arm), *this),
      settings_(link_.own().state.settings),
      watch_(link_, alarms_, profile_.frozen_ns,
             {[this] { return self_check_.is_started(); }, [this] { return responds(); },
              [this](bool frozen) { on_frozen(frozen); }}),
      view_(profile_, link_, watch_, tickets_, alarms_),
      task_(link_, watch_),
      queue_(planner_, profile_.queue_capacity, tickets_, task_, view_),
      control_(link_.own().state.control,
               [this](const Control::Ending& ending) { return end_control(ending); }) {
  alarms_.keep_in(link_.own().state.alarms);
  tickets_.keep_in(link_.own().state.tickets);
  tickets_.on_end([this](const Ticket& ticket) { record_end(ticket); });
  link_.start();
  watch_.start();
}

Robot::~Robot() {
  interrupt();
  control_.close();
  saver_.reset();
  watch_.close();
  link_.close();
}

void Robot::keep_state(const std::string& directory, PositionSaver::Warn warn) {
  const auto reporter = [this, warn = std::move(warn)](std::int32_t code) {
    return [this, warn, code](const std::string& text) {
      alarms_.add(code, false, text);
      if (warn) warn(text);
    };
  };
  const std::filesystem::path where =
      directory.empty() ? default_state_directory() : std::filesystem::path(directory);
  if (where.empty()) {
    const char* const remedy = "set CORBOT_STATE_DIR or HOME, or give --state-dir";
    reporter(kAlarmPositionNotSaved)(fmt::format("the last position is not saved: {}", remedy));
    reporter(kAlarmAuditLogIncomplete)(fmt::format("there is no audit log: {}", remedy));
    return;
  }
  saver_ = std::make_unique<PositionSaver>(link_, profile_.arm, PositionStore(where, name_, "servant"),
                                           reporter(kAlarmPositionNotSaved));
  try {
    audit_log_ = std::make_unique<AuditLog>(where, name_, reporter(kAlarmAuditLogIncomplete));
  } catch (const std::runtime_error& failed) {
    return reporter(kAlarmAuditLogIncomplete)(failed.what());
  }
  audit_.store(audit_log_.get(), std::memory_order_release);
}

void Robot::record(const AuditEntry& call) const noexcept {
  if (AuditLog* const log = audit_.load(std::memory_order_acquire)) log->record(call);
}

void Robot::record_end(const Ticket& ticket) const {
  AuditLog* const log = audit_.load(std::memory_order_acquire);
  if (log == nullptr) return;
  const std::string reason = ticket.reason.empty() ? "" : ": " + ticket.reason;
  const char* const end = ticket.state == TicketState::kDone      ? "done"
                          : ticket.state == TicketState::kStopped ? "stopped"
                                                                  : "failed";
  log->record_end(ticket.last, end + reason);
}

void Robot::interrupt() {
  task_.close();
  self_check_.close();
  tickets_.close();
}

void Robot::on_completion(const Completion& completion) {
  tickets_.complete(completion.id, completion.verdict);
}

void Robot::on_alarm(const AlarmEvent& alarm) {
  if (alarm.code == AlarmCode::kHeld)
    return alarms_.add(static_cast<std::int32_t>(alarm.code), true, held_alarm_text(alarm));
  if (alarm.code != AlarmCode::kCleared) return alarms_.add(alarm);
  alarms_.deactivate();
  clears_reported_ = alarm::cleared_count(alarm);
}

void Robot::on_lost(const std::string& reason) {
  alarms_.add(kAlarmTaskGone, true, reason);
  tickets_.fail_pending(reason);
  task_.notify();
}

void Robot::on_drained(const Snapshot& before) {
  // Also where nobody has waited for the end of that Clear.
  if ((before.flags & kSnapshotHeld) == 0) set_holds_cleared(before.holds_done);
  tickets_.reconcile(before);
  task_.notify();
}

void Robot::on_attached(bool again) {
  control_.allow_expiry();
  if (!again) return queue_.repeat_cancel();
  alarms_.deactivate(kAlarmTaskGone);
  alarms_.add(kAlarmTaskRestarted, false,
              "a new real-time task has adopted the arm where the last one left it");
}

void Robot::on_inherit(const Inheritance& inheritance) {
  if (inheritance.former == nullptr) return;
  const ServantSegment& own = link_.own();
  InheritedState inherited = read_inherited(*inheritance.former, profile_.arm, own.next_command_id.load());
  if (inherited.settings) settings_.inherit(*inherited.settings);
  // What the former one has raised itself, this one finds out anew. And where the task is in no Error, nothing is
  // the cause of one; what it has raised since comes after this.
  const bool is_in_error = inheritance.last == nullptr || inheritance.last->state == RtState::kError;
  for (AlarmEntry& alarm : inherited.alarms)
    alarm.active =
        alarm.active && is_in_error && alarm.code != kAlarmTaskGone && alarm.code != kAlarmTaskFrozen;
  alarms_.inherit(inherited.alarms);
  tickets_.inherit(inherited.tickets);
  queue_.inherit(inherited.tickets);
  if (inherited.control) control_.inherit(*inherited.control);
  if (!inherited.held_by.empty()) set_held_by(inherited.held_by);
  if (inherited.invalid == 0) return;
  alarms_.add(
      kAlarmFormerServantInvalid, false,
      fmt::format("{} records of the servant before this one are invalid and were left out: check speeds "
                  "and tool pitch",
                  inherited.invalid));
}

bool Robot::responds() {
  (void)tickets_.pending();
  (void)alarms_.cause();
  (void)settings_.get();
  (void)control_.holder();
  return !task_.is_closing() && self_check_.passes();
}

void Robot::on_frozen(bool frozen) {
  tickets_.suspend_waits(frozen);
  task_.notify();
}

corbot_ticket Robot::accept(const MotionRequest& request, std::uint64_t arrival, const std::string& key) {
  // Before all else: a bad argument is refused at once, however long the present plan takes.
  const PlanSettings now = settings_.get();
  if (const auto refusal = planner_.check(now, request)) throw refused(*refusal);
  return queue_.accept(request, now, arrival, [&] { return control_.use(key); });
}

StopCounts Robot::stops() const {
  const auto channel = link_.channel();
  if (!channel) return {};
  const std::uint64_t all = channel->stops();
  // After the other, as it is raised before: at worst one of this servant's is left out of those by others, and what
  // arrived meanwhile is taken for older than it is.
  return {all, all - own_stops_.load(std::memory_order_acquire)};
}

corbot_motion_info Robot::wait(corbot_ticket id, double timeout_s) const {
  std::optional<std::chrono::steady_clock::time_point> until;
  if (timeout_s >= 0.0) {
    using Seconds = std::chrono::duration<double>;
    const Seconds bounded(std::min(timeout_s, 1e6));
    until = std::chrono::steady_clock::now() +
            std::chrono::duration_cast<std::chrono::steady_clock::duration>(bounded);
  }
  const auto ticket = tickets_.wait(id, until);
  if (!ticket) throw no_such_motion(id);
  return view_.describe(*ticket);
}

void Robot::finish(corbot_ticket id) const { report_end(tickets_.wait(id, std::nullopt)); }

bool Robot::is_finished(corbot_ticket id) const {
  const auto ticket = tickets_.find(id);
  if (ticket && ticket->state == TicketState::kPending && !ends_waits()) return false;
  report_end(ticket);
  return true;
}

void Robot::report_end(const std::optional<Ticket>& ticket) const {
  if (!ticket) throw internal("a motion that was waited for is forgotten");
  switch (ticket->state) {
    case TicketState::kDone:
      return;
    case TicketState::kStopped:
      throw stopped(ticket->reason);
    case TicketState::kFailed: {
      const std::string cause = view_.error_cause();
      throw not_ready(view_.state() == CORBOT_STATE_ERROR && !cause.empty() ? cause : ticket->reason);
    }
    case TicketState::kPending:
      if (watch_.is_frozen()) throw not_ready(watch_.cause() + "; what becomes of the motion is open");
      throw not_ready("the servant is shutting down; the motion is carried out");
  }
}

void Robot::cancel(corbot_ticket id) { queue_.cancel(id); }

Robot::CountedStop Robot::count_stop(const LivingTask& task) {
  // Every number up to here was planned before this Stop.
  const std::uint64_t last = task.own().next_command_id.load(std::memory_order_acquire) - 1;
  own_stops_.fetch_add(1, std::memory_order_acq_rel);
  return {task.channel->request_stop(), last};
}

void Robot::await_stop(const LivingTask& task, const CountedStop& stop) {
  task_.await(task, kSettle_s, "a Stop",
              [&](const Snapshot& now) { return !is_earlier_stop(now.stops_done, stop.count); });
  // The verdicts are out, but the link's thread may not have read them yet: a client that reads the state or
  // a ticket after Stop has returned must find what Stop did.
  tickets_.wait_ended(0, stop.last, kReportsRead);
}

void Robot::stop() {
  // A frozen task finds the request when it goes on; the caller hears below that it is not carried out yet.
  const LivingTask task = task_.connected();
  await_stop(task, count_stop(task));
}

void Robot::request_stop() {
  const LivingTask task = task_.connected();
  const CountedStop stop = count_stop(task);
  const std::lock_guard lock(requested_mutex_);
  requested_ = stop;
}

void Robot::await_requested_stops() {
  const LivingTask task = task_.connected();
  CountedStop newest{};
  {
    const std::lock_guard lock(requested_mutex_);
    newest = requested_;
  }
  await_stop(task, newest);
}

void Robot::stop_and_hold(std::string by) {
  set_held_by(std::move(by));
  // Before the stop: what is planned after that stop is not begun before the task has seen this, see HoldLatch.
  const std::uint64_t count = link_.own().control.hold_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  stop();
  task_.await(task_.connected(), kSettle_s, "a StopAndHold",
              [&](const Snapshot& now) { return now.holds_done >= count; });
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
  return held_by_.empty() ? alarm_text(alarm) : alarm_text(alarm) + ", asked for by " + held_by_;
}

std::string Robot::acquire(const std::string& who, double lease_s, const Control::Admit& wanted) {
  return control_.acquire(who, lease_s, [&] {
    queue_.check_empty(task_.living());
    wanted();
  });
}

/// A task that is gone moves nothing; a frozen one finds the stop when it goes on.
std::string Robot::end_control(const Control::Ending& ending) noexcept {
  std::string failure = "no memory";  // short enough to need none
  try {
    try {
      stop();
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

void Robot::pause(bool on) {
  const LivingTask task = task_.living();
  task.own().control.pause.store(on ? 1 : 0, std::memory_order_relaxed);
  task_.await_seen(task, kSettle_s, "a Pause");
}

void Robot::set_override(double percent) {
  const double ratio = checked_percent("percent", percent);
  const LivingTask task = task_.living();
  task.own().control.override_ratio.store(ratio, std::memory_order_relaxed);
  task_.await_seen(task, kSettle_s, "an Override");
}

void Robot::clear() {
  const LivingTask task = task_.living();
  if (view_.held()) {
    task_.await(task, kSettle_s, "a StopAndHold",
                [this](const Snapshot& now) { return now.state == RtState::kError || !view_.held(); });
  }
  if (view_.snapshot().state != RtState::kError) return;
  const std::uint64_t count = task.own().control.clear_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  Snapshot now{};
  task_.await(task, kSettle_s, "a Clear", [&](const Snapshot& snapshot) {
    now = snapshot;
    return snapshot.clears_done >= count;
  });
  if (now.state == RtState::kError) throw not_ready(view_.error_cause());
  set_holds_cleared(now.holds_done);
  // What the client reads next has no alarm that this Clear has taken back, and every one that came since.
  for (Patience patience(kReportsRead);;) {
    const bool is_last = patience.is_over();
    const std::uint64_t seen = task_.changes();
    if (clears_reported_ >= count || is_last) return;
    task_.check(task);
    task_.wait_change(seen);
  }
}

void Robot::set_speed(double percent) {
  const double ratio = checked_percent("percent", percent);
  settings_.change([ratio](PlanSettings& now) { now.speed_ratio = ratio; });
}

void Robot::set_joint_speed(int joint, double percent) {
  if (joint < 0 || joint >= static_cast<int>(profile_.arm.dof)) {
    // The parameter's name is the interface's.
    throw bad_argument("articulation", joint,
                       fmt::format("joint {}, allowed 0 to {}", joint, profile_.arm.dof - 1));
  }
  const double ratio = checked_percent("percent", percent);
  settings_.change(
      [&](PlanSettings& now) { now.joint_speed_ratio[static_cast<std::size_t>(joint)] = ratio; });
}

void Robot::set_all_speeds(double percent) {
  const double ratio = checked_percent("percent", percent);
  settings_.change([ratio](PlanSettings& now) { now.joint_speed_ratio.fill(ratio); });
}

void Robot::set_tool_pitch(double degrees) {
  if (!(degrees >= -180.0 && degrees <= 180.0)) {
    throw bad_argument("degrees", degrees, fmt::format("{:.6g} degrees, allowed -180 to 180", degrees));
  }
  settings_.change([degrees](PlanSettings& now) { now.tool_pitch_rad = to_radians(degrees); });
}

double Robot::tool_pitch_deg() const { return tidy_degrees(settings_.get().tool_pitch_rad); }

}  // namespace corbot
