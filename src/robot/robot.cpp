// SPDX-License-Identifier: Apache-2.0
#include "robot/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/segment_fingerprint.h"
#include "corbot/channel/alarms.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "planner/setting_rules.h"
#include "robot/inherited_state.h"

namespace corbot {
Robot::Robot(Profile profile, const std::string& name)
    : profile_(std::move(profile)),
      name_(name),
      planner_(profile_.arm),
      limits_(profile_.arm, "the soft limits"),
      shapes_(profile_.arm, "the further planes and boxes of the workspace"),
      link_(name, segment_fingerprint(profile_), *this),
      settings_(link_.own().state.settings),
      watch_(link_, alarms_, profile_.frozen_ns,
             {[this] { return self_check_.is_started(); }, [this] { return responds(); },
              [this](bool frozen) { on_frozen(frozen); }}),
      view_(profile_, link_, watch_, tickets_, alarms_, settings_),
      task_(link_, watch_),
      queue_(planner_, profile_.queue_capacity, tickets_, task_, view_, limits_, shapes_),
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
  const std::string& kind = profile_.backend.kind;
  if (const std::string wrong = limits_.keep_in(SoftLimitsStore(where, name_, kind)); !wrong.empty()) {
    reporter(kAlarmSoftLimitsUnknown)(
        fmt::format("the soft limits are not known, no joint moves until they are set or reset: {}", wrong));
  }
  if (const std::string wrong = shapes_.keep_in(FurtherShapesStore(where, name_, kind)); !wrong.empty()) {
    reporter(kAlarmShapesUnknown)(fmt::format(
        "the further planes and boxes of the workspace are not known, no joint moves until they are set or "
        "reset: {}",
        wrong));
  }
  saver_ = std::make_unique<PositionSaver>(link_, profile_.arm, PositionStore(where, name_, kind, "servant"),
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
  // A held task raises this alarm again at its start, and another servant reads the last alarm once more.
  if (alarm.code == AlarmCode::kHeld) return add_held_alarm(alarm);
  // After several refused Clears, the last one says where the joint is.
  if (alarm.code == AlarmCode::kJointBeyondRange) alarms_.deactivate(static_cast<std::int32_t>(alarm.code));
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
  // Covers also a Clear whose caller no longer waited for its end.
  if ((before.flags & kSnapshotHeld) == 0) set_holds_cleared(before.holds_done);
  clears_drained_ = before.clears_done;
  tickets_.reconcile(before);
  queue_.finish_cancel(before);
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
  // Alarms that the previous servant raised itself are not inherited as active: this servant detects them
  // again. If the task is not in Error, no alarm causes one. Alarms that the task has raised since follow
  // later.
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
      fmt::format("{} records of the servant before this one are invalid and were left out: check speeds, "
                  "tool pitch and frames",
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

corbot_ticket Robot::accept(const MotionRequest& request, std::uint64_t arrival, const std::string& key,
                            const Wanted& wanted) {
  // Precedes all else: a bad argument is refused at once, however long the present plan takes.
  PlanSettings now = settings_in_force();
  if (const auto refusal = planner_.check(now, request))
    throw refused(request, *refusal, profile_.arm.kinematics);
  const auto admit = [&] { return control_.use(key); };
  return queue_.accept(request, now, arrival, admit, wanted);
}

MotionPlan Robot::plan(const MotionRequest& request) {
  PlanSettings now = settings_in_force();
  if (const auto refusal = planner_.check(now, request))
    throw refused(request, *refusal, profile_.arm.kinematics);
  const PlanStart start = queue_.next_start();
  limits_.check_known(request);
  now = settings_in_force();  // at the start: they may have changed while other calls planned
  shapes_.check_known_at(request, frames_in_force(profile_.arm.kinematics, now).base_T_0);
  const PlanResult result = planner_.plan(start, now, request);
  if (const auto* refusal = std::get_if<PlanRefusal>(&result))
    throw refused(request, *refusal, profile_.arm.kinematics);
  const auto& commands = std::get<std::vector<Command>>(result);
  return {start.position_q, commands.back().end_q, rate::parts_of(profile_.arm, now, result)};
}

StopCounts Robot::stops() const {
  const std::uint64_t all = link_.stops();
  if (all == 0) return {};  // no task has connected yet
  // Read after `all`, since count_now() raises own_stops_ first. At worst by_others omits one stop of this
  // servant, and a stop that arrived meanwhile counts as older than it is.
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
  const bool knows_all = link_.has_been_attached();  // read before the look-up
  const auto ticket = tickets_.wait(id, until);
  // Otherwise the ticket may be the previous servant's, and only a task knows those.
  if (!ticket) throw knows_all ? no_such_motion(id) : no_data(link_.cause());
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
  if (!ticket) throw internal("the record of the motion was dropped while the call waited");
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
      if (watch_.is_frozen()) throw not_ready(watch_.cause() + "; the outcome of the motion is unknown");
      throw not_ready("the servant is shutting down; the task still carries the motion out");
  }
}

void Robot::cancel(corbot_ticket id, const Wanted& wanted) { queue_.cancel(id, wanted); }

std::string Robot::acquire(const std::string& who, double lease_s, const Wanted& wanted) {
  const auto admit = [&] {
    queue_.check_empty(task_.living(), wanted);
    check(wanted);
  };
  return control_.acquire(who, lease_s, admit, wanted);
}

void Robot::set_speed(double percent) {
  const double ratio = checked_percent("percent", percent);
  settings_.change([ratio](PlanSettings& now) { now.speed_ratio = ratio; });
}

void Robot::set_joint_speed(int joint, double percent) {
  check_setting(check_joint_number(profile_.arm, joint));
  const double ratio = checked_percent("percent", percent);
  settings_.change(
      [&](PlanSettings& now) { now.joint_speed_ratio[static_cast<std::size_t>(joint)] = ratio; });
}

void Robot::set_all_speeds(double percent) {
  const double ratio = checked_percent("percent", percent);
  settings_.change([ratio](PlanSettings& now) { now.joint_speed_ratio.fill(ratio); });
}

void Robot::set_tool_pitch(double degrees) {
  check_setting(check_tool_pitch(profile_.arm.kinematics, degrees));
  settings_.change([degrees](PlanSettings& now) { take_tool_pitch(now, degrees); });
}

void Robot::set_tool_orientation(const Quaternion& orientation) {
  check_setting(check_tool_orientation(profile_.arm, orientation));
  settings_.change([&](PlanSettings& now) { take_tool_orientation(now, orientation); });
}

void Robot::reset_tool_orientation() { settings_.change(take_any_orientation); }

void Robot::set_soft_limits(const JointRanges& shown) {
  const auto limits = soft_limits_of(profile_.arm, shown);
  if (const auto* refusal = std::get_if<PlanRefusal>(&limits)) check_setting(*refusal);
  queue_.change_limits(std::get<JointRanges>(limits));
}

std::optional<JointRanges> Robot::soft_limits() const {
  if (!limits_.is_known()) return std::nullopt;
  return limits_.wanted().value_or(profile_ranges(profile_.arm));
}

void Robot::reset_soft_limits() { queue_.reset_limits(); }

void Robot::check_setting(const std::optional<PlanRefusal>& refusal) const {
  if (refusal) throw refused(*refusal, profile_.arm.kinematics);
}

double Robot::tool_pitch_deg() const { return tidy_degrees(settings_.get().tool_pitch_rad.value_or(0.0)); }

}  // namespace corbot
