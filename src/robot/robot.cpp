// SPDX-License-Identifier: Apache-2.0
#include "robot/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "corbot/channel/fingerprint.h"
#include "corbot/channel/wake.h"
#include "corbot/units.h"

namespace corbot {
namespace {

constexpr double kSettle_s = 10.0;  // for what the task does at once, or as fast as the arm's limits allow
constexpr std::chrono::seconds kVerdictsRead{1};
constexpr std::int64_t kPoll_ns = 10'000'000;

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
      watch_(link_, alarms_,
             {[this] { return self_check_.is_started(); }, [this] { return responds(); },
              [this](bool frozen) { tickets_.suspend_waits(frozen); }}),
      view_(profile_, link_, watch_, tickets_, alarms_) {
  link_.start();
  watch_.start();
}

Robot::~Robot() {
  interrupt();
  saver_.reset();
  watch_.close();
  link_.close();
}

void Robot::save_position(const std::string& directory, PositionSaver::Warn warn) {
  const auto report = [this, warn = std::move(warn)](const std::string& text) {
    alarms_.add(kAlarmPositionNotSaved, false, text);
    if (warn) warn(text);
  };
  const std::filesystem::path where =
      directory.empty() ? default_state_directory() : std::filesystem::path(directory);
  if (where.empty()) {
    report("the last position is not saved: set CORBOT_STATE_DIR or HOME, or give --state-dir");
    return;
  }
  saver_ =
      std::make_unique<PositionSaver>(link_, profile_.arm, PositionStore(where, name_, "servant"), report);
}

void Robot::interrupt() {
  closing_ = true;
  self_check_.close();
  tickets_.close();
}

void Robot::on_completion(const Completion& completion) {
  tickets_.complete(completion.id, completion.verdict);
}

void Robot::on_alarm(const AlarmEvent& alarm) { alarms_.add(alarm); }

void Robot::on_lost(const std::string& reason) {
  alarms_.add(kAlarmTaskGone, true, reason);
  tickets_.fail_pending(reason);
}

void Robot::on_attached(bool again) {
  if (!again) return;
  alarms_.deactivate(kAlarmTaskGone);
  alarms_.add(kAlarmTaskRestarted, false,
              "a new real-time task has adopted the arm where the last one left it");
}

std::shared_ptr<Segment> Robot::connected_segment() const {
  auto segment = link_.segment();
  if (!segment || !link_.alive()) throw not_ready(link_.cause());
  return segment;
}

std::shared_ptr<Segment> Robot::living_segment() const {
  auto segment = connected_segment();
  if (watch_.is_frozen()) throw not_ready(watch_.cause());
  return segment;
}

bool Robot::responds() const {
  (void)tickets_.pending();
  (void)alarms_.cause();
  (void)settings();
  return !closing_ && self_check_.passes();
}

void Robot::await(Segment& segment, double seconds, const std::string& what,
                  const std::function<bool(const Snapshot&)>& done) const {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  const std::atomic<std::uint32_t>& wake = segment.layout().wake;
  for (;;) {
    const std::uint32_t seen = wake.load(std::memory_order_acquire);
    Snapshot now{};
    if (segment.layout().snapshot.load(now) && done(now)) return;
    if (!link_.alive()) throw not_ready(link_.cause());
    if (watch_.is_frozen()) throw not_ready(watch_.cause());
    if (closing_) throw not_ready("the servant is shutting down");
    if (std::chrono::steady_clock::now() > deadline)
      throw not_ready(fmt::format("{} did not end in {} s", what, seconds));
    // A wake-up comes with verdicts; the snapshot that follows it may be a moment later.
    wait_change(wake, seen, kPoll_ns);
  }
}

void Robot::await_seen(Segment& segment, const std::string& what) const {
  Snapshot before{};
  if (!segment.layout().snapshot.load(before)) return;
  // The cycle after `before` may have read the flags already when they were written;
  // the one after that has not.
  await(segment, kSettle_s, what, [&](const Snapshot& now) {
    return now.incarnation != before.incarnation || now.cycle >= before.cycle + 2;
  });
}

corbot_ticket Robot::accept(const MotionRequest& request) {
  // Before the planning lock: a bad argument is refused at once, however long the present plan takes.
  if (const auto refusal = planner_.check(settings(), request)) throw refused(*refusal);
  const std::lock_guard lock(planning_mutex_);
  const auto segment = living_segment();
  if (tickets_.pending() >= static_cast<std::size_t>(profile_.queue_capacity))
    throw queue_full(profile_.queue_capacity);
  // A Stop from here on makes the task refuse what is planned now.
  const std::uint64_t epoch = segment->layout().control.stop_count.load(std::memory_order_acquire);
  const PlanStart start = plan_start(*segment, epoch);
  PlanResult result = planner_.plan(start, settings(), request);
  if (const auto* refusal = std::get_if<PlanRefusal>(&result)) throw refused(*refusal);
  auto& commands = std::get<std::vector<Command>>(result);
  if (commands.empty() || commands.size() > 2) throw internal("the planner returned no motion");
  double gripper = start.gripper;
  for (const Command& command : commands) {
    if (command.kind == MotionKind::kGripper) gripper = command.gripper.from + command.gripper.law.distance;
  }
  return hand_over(*segment, epoch, commands, gripper);
}

PlanSettings Robot::settings() const {
  const std::lock_guard lock(settings_mutex_);
  return settings_;
}

PlanStart Robot::plan_start(Segment& segment, std::uint64_t epoch) {
  Snapshot now{};
  await(segment, kSettle_s, "a Stop", [&](const Snapshot& snapshot) {
    now = snapshot;
    return snapshot.stops_done >= epoch || snapshot.state == RtState::kError;
  });
  if (now.state == RtState::kError) throw not_ready(view_.error_cause());
  if (last_accepted_ != 0 && last_epoch_ == epoch) {
    const auto last = tickets_.find(last_accepted_);
    if (last && last->state == TicketState::kPending) return planned_end_;
  }
  // No motion of this servant is running; an earlier servant's may be,
  // and the verdict may be ahead of the snapshot.
  const std::uint64_t next = segment.layout().header.next_command_id.load(std::memory_order_relaxed);
  await(segment, kSettle_s, "the motions accepted before this servant's start",
        [&](const Snapshot& snapshot) {
          now = snapshot;
          return snapshot.command_id == 0 &&
                 (snapshot.last_done_id + 1 >= next || segment.layout().commands.size() == 0);
        });
  if (now.state == RtState::kError) throw not_ready(view_.error_cause());
  return {now.position_rad, now.gripper};
}

corbot_ticket Robot::hand_over(Segment& segment, std::uint64_t epoch, std::vector<Command>& commands,
                               double gripper) {
  std::atomic<std::uint64_t>& next = segment.layout().header.next_command_id;
  const std::uint64_t first = next.load(std::memory_order_relaxed);
  Ticket ticket;
  ticket.first = first;
  ticket.last = first + commands.size() - 1;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    commands[i].id = first + i;
    commands[i].epoch = epoch;
    if (i == 1) ticket.second_from_s = ticket.duration_s;
    ticket.duration_s += commands[i].duration_s;
  }
  // Both before the task can answer, and before this process can die with the commands published: a number is
  // used once.
  tickets_.add(ticket);
  next.store(ticket.last + 1, std::memory_order_release);
  // A producer for each motion: one that is kept would lose a command after a corrupt index, see ring.h.
  if (!RingProducer(segment.layout().commands).push_all(commands.data(), commands.size())) {
    next.store(first, std::memory_order_release);
    tickets_.remove(ticket.last);
    throw queue_full(static_cast<int>(segment.layout().commands.capacity()));
  }
  last_accepted_ = ticket.last;
  last_epoch_ = epoch;
  planned_end_ = {commands.back().end_rad, gripper};
  if (!link_.alive())
    tickets_.fail_pending(link_.cause());  // died in between: on_lost may have come before add
  return ticket.last;
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
  if (!ticket) {
    throw bad_argument("id", static_cast<double>(id),
                       fmt::format("there is no motion {}, or it is forgotten", id));
  }
  return view_.describe(*ticket);
}

void Robot::finish(corbot_ticket id) const {
  const auto ticket = tickets_.wait(id, std::nullopt);
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

void Robot::stop() {
  // A frozen task finds the request when it goes on; the caller hears below that it is not carried out yet.
  const auto segment = connected_segment();
  ControlFlags& control = segment->layout().control;
  // Every number up to here was planned before this Stop.
  const std::uint64_t last = segment->layout().header.next_command_id.load(std::memory_order_acquire) - 1;
  const std::uint64_t count = control.stop_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  await(*segment, kSettle_s, "a Stop", [&](const Snapshot& now) { return now.stops_done >= count; });
  // Not before: a paused motion must not go on for a cycle first.
  control.pause.store(0, std::memory_order_relaxed);
  // The verdicts are out, but the link's thread may not have read them yet: a client that reads the state or
  // a ticket after Stop has returned must find what Stop did.
  tickets_.wait_ended_up_to(last, std::chrono::steady_clock::now() + kVerdictsRead);
}

void Robot::pause(bool on) {
  const auto segment = living_segment();
  segment->layout().control.pause.store(on ? 1 : 0, std::memory_order_relaxed);
  await_seen(*segment, "a Pause");
}

void Robot::set_override(double percent) {
  const double ratio = checked_percent("percent", percent);
  const auto segment = living_segment();
  segment->layout().control.override_ratio.store(ratio, std::memory_order_relaxed);
  await_seen(*segment, "an Override");
}

void Robot::clear() {
  const auto segment = living_segment();
  if (view_.snapshot().state == RtState::kError) {
    const std::uint64_t count =
        segment->layout().control.clear_count.fetch_add(1, std::memory_order_acq_rel) + 1;
    Snapshot now{};
    await(*segment, kSettle_s, "a Clear", [&](const Snapshot& snapshot) {
      now = snapshot;
      return snapshot.clears_done >= count;
    });
    if (now.state == RtState::kError) throw not_ready(view_.error_cause());
  }
  alarms_.deactivate();
}

void Robot::set_speed(double percent) {
  const double ratio = checked_percent("percent", percent);
  const std::lock_guard lock(settings_mutex_);
  settings_.speed_ratio = ratio;
}

void Robot::set_joint_speed(int joint, double percent) {
  if (joint < 0 || joint >= static_cast<int>(profile_.arm.dof)) {
    // The parameter's name is the interface's.
    throw bad_argument("articulation", joint,
                       fmt::format("joint {}, allowed 0 to {}", joint, profile_.arm.dof - 1));
  }
  const double ratio = checked_percent("percent", percent);
  const std::lock_guard lock(settings_mutex_);
  settings_.joint_speed_ratio[static_cast<std::size_t>(joint)] = ratio;
}

void Robot::set_all_speeds(double percent) {
  const double ratio = checked_percent("percent", percent);
  const std::lock_guard lock(settings_mutex_);
  settings_.joint_speed_ratio.fill(ratio);
}

void Robot::set_tool_pitch(double degrees) {
  if (!(degrees >= -180.0 && degrees <= 180.0)) {
    throw bad_argument("degrees", degrees, fmt::format("{:.6g} degrees, allowed -180 to 180", degrees));
  }
  const std::lock_guard lock(settings_mutex_);
  settings_.tool_pitch_rad = to_radians(degrees);
}

double Robot::tool_pitch_deg() const { return tidy_degrees(settings().tool_pitch_rad); }

}  // namespace corbot
