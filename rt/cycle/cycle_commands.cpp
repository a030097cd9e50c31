// SPDX-License-Identifier: Apache-2.0
// The commands of a cycle: the beginning and the end of a command, and the verdicts of the waiting ones.
#include <algorithm>
#include <cmath>
#include <optional>

#include "corbot/channel/alarms.h"
#include "corbot/motion/path.h"
#include "rt/cycle/command_check.h"
#include "rt/cycle/cycle.h"

namespace corbot::rt {

void Cycle::handle_command() noexcept {
  if (fault_stop_.is_latched()) {
    orphaned_ = false;
    fault_ran_ns_ += gap_.seen_ns();
    if (fault_stop_.is_slowing_down() && !has_slowed_down()) return;
    end_fault();
    end_stop();
    return;
  }
  if (is_stopping()) {
    if (!is_path_at_rest() || (!shutdown_ && awaits_device())) return;
    end_slowed_down();
    if (hold_.is_active()) refuse_queue(Verdict::kStopped, false);
    if (is_stop_requested()) refuse_queue(Verdict::kStopped, true);
    if (shutdown_) refuse_queue(Verdict::kEnded, false);
    if (orphaned_) refuse_queue(Verdict::kOrphaned, false);
    orphaned_ = false;
    stands_ = is_device_starting();
    end_stop();
    return;
  }
  stop_waited_ns_ = 0;
  if (is_slowing_down()) end_slowed_down();
  if (is_running_) return;
  refuse_cancelled();
  if (!is_device_open() || device_.may_fall()) return;
  if (fetch_command()) begin_command();
}

/// Tells whether set-points rest: no motion runs, or it was slowed down to rest, or it is at its end.
bool Cycle::is_path_at_rest() const noexcept {
  return !is_running_ || governor_.holding() || governor_.finished() || settling_.is_active();
}

void Cycle::end_slowed_down() noexcept {
  if (!is_running_ || !is_path_at_rest()) return;
  if (is_taken_back()) return end_motion(Verdict::kStopped);
  end_motion(shutdown_ ? Verdict::kEnded : Verdict::kOrphaned);
}

/// Tells whether the arm has slowed down for a fault: it is at rest, or the servos no longer follow.
bool Cycle::has_slowed_down() const noexcept {
  if (!is_device_open()) return true;
  const bool set_point_rests = fault_stop_.is_by_joint()
                                   ? joint_ramp_.at_rest()
                                   : !is_running_ || governor_.holding() || governor_.finished();
  return set_point_rests && have_joints_come_to_rest() && has_device_seen_rest();
}

/// Tells whether the joints have come to rest. Joints lag behind their set-points, so they keep their energy
/// while they are seen to move. A joint that does not come to rest is awaited for the time of a ramp.
bool Cycle::have_joints_come_to_rest() const noexcept {
  return !backend_.has_encoders() || rest_.is_at_rest() || fault_ran_ns_ >= ramp_ns_;
}

/// Tells whether the device has seen the rest. A device that misses frames is behind, and later frames would
/// move the arm after a Clear. It is awaited for the time of a ramp, too.
bool Cycle::has_device_seen_rest() const noexcept {
  return device_.times().cycle >= moved_in_ || fault_ran_ns_ >= ramp_ns_;
}

/// Tells whether a stop at rest must wait with its verdicts and its confirmation. The device has not taken
/// the resting set-point then, which would still move the arm after missed frames. A device that does not
/// take it in time is a fault. At an orderly end nothing waits: the device gets no later frame.
bool Cycle::awaits_device() noexcept {
  const bool is_behind = is_device_open() && device_.times().cycle < moved_in_;
  stop_waited_ns_ = is_behind ? stop_waited_ns_ + gap_.seen_ns() : 0;
  if (stop_waited_ns_ <= std::max(ramp_ns_, settle_ns_)) return is_behind;
  fault(alarm::goal_not_reached({.joint = -1, .error_q = 0.0, .allowed_q = 0.0}), FaultStop::Way::kOnPath);
  fault_ran_ns_ = ramp_ns_;  // joints and device have had this time
  return true;
}

/// Called at rest. Gives their verdicts to the running and the waiting commands.
void Cycle::end_fault() noexcept {
  fault_stop_.come_to_rest();
  if (is_running_) end_motion(Verdict::kFault);
  refuse_queue(Verdict::kFault, false);
}

void Cycle::end_motion(Verdict verdict) noexcept {
  is_running_ = false;
  settling_.end();
  governor_.rest();
  complete(running_.id, verdict);
}

/// Called at rest. A hold becomes an Error from now on.
void Cycle::end_stop() noexcept {
  stop_waited_ns_ = 0;
  if (hold_.latch()) fault(alarm::held(), FaultStop::Way::kHeld);
  if (snapshot_.stops_done == stops_.newest()) return;
  snapshot_.stops_done = stops_.newest();
  published_ = true;
}

/// Called at rest, like refuse_cancelled(). Gives verdicts to at most two rings full of commands.
/// `older_only`: up to the first that the stop does not concern.
void Cycle::refuse_queue(Verdict verdict, bool older_only) noexcept {
  for (std::size_t i = 0; i <= CommandQueue::kMost && fetch_command(); ++i) {
    if (older_only && !is_earlier_stop(queue_.waiting().epoch, stops_.newest())) return;
    refuse(verdict);
  }
}

void Cycle::refuse_cancelled() noexcept {
  for (std::size_t i = 0; i <= CommandQueue::kMost && fetch_command(); ++i) {
    if (!queue_.is_cancelled(queue_.waiting().id)) return;
    refuse(Verdict::kStopped);
  }
}

void Cycle::refuse(Verdict verdict) noexcept {
  queue_.release();
  complete(queue_.waiting().id, verdict);
}

/// Called at rest. Numbers whose commands are lost end in their turn: no call may wait for them forever.
bool Cycle::fetch_command() noexcept {
  CommandQueue::Fetch fetched = queue_.fetch();
  if (fetched == CommandQueue::Fetch::kCorrupt) raise(alarm::ring_corrupt());
  if (fetched == CommandQueue::Fetch::kCorrupt || fetched == CommandQueue::Fetch::kLost) {
    queue_.end_lost(snapshot_.cycle);
    published_ = true;
    fetched = queue_.fetch();
  }
  return fetched == CommandQueue::Fetch::kOne;
}

void Cycle::begin_command() noexcept {
  const Command& next = queue_.waiting();
  // A Stop may have been counted between this cycle's look at the count and the push.
  if (stops_.is_to_be_read(*flags_, next.epoch)) return;
  if (is_earlier_stop(next.epoch, stops_.newest())) return refuse(Verdict::kStopped);
  // The command was planned from the previous task's position, for a caller whose motion was reported lost
  // with that task.
  if (next.incarnation != static_cast<std::uint32_t>(snapshot_.incarnation)) return refuse(Verdict::kLost);
  if (paused_) return;

  CommandVerdict verdict =
      check_command(arm_, next, {queue_.last_done(), set_point_.position_q, set_point_.opening});
  if (next.epoch != stops_.newest()) verdict = {Verdict::kMalformed, -1, static_cast<double>(next.epoch)};
  if (verdict.ok()) {
    take_frames(next, framed_arm_.kinematics);
    const std::optional<CommandVerdict> checked = check_knots(next);
    if (!checked) return;  // the rest in the next cycles
    verdict = *checked;
  }
  if (verdict.ok() && !take_workspace()) verdict = {Verdict::kMalformed, -1, 0.0};
  if (verdict.ok()) {
    workspace_check_.begin(framed_arm_, set_point_.position_q);
    const SetPointVerdict end = workspace_check_.see(framed_arm_, next.end_q);
    if (!end.ok) verdict = {Verdict::kLimit, -1, end.alarm.value};
  }
  if (!verdict.ok()) {
    raise(alarm::command_refused(
        {.id = next.id, .verdict = verdict.verdict, .joint = verdict.joint, .value = verdict.value}));
    return refuse(verdict.verdict);
  }
  queue_.release();
  running_ = next;
  is_running_ = true;
  base_ = set_point_;
  governor_.set_target(snapshot_.override_ratio);
  const rate::RatePath path = queue_.waiting_rate();
  if (path.knots.empty()) return governor_.begin(governed_motion(arm_, running_));
  differences_.begin(set_point_.position_q);
  path_check_.begin(running_.kind == MotionKind::kArc ? running_.arc.solution : running_.line.solution);
  governor_.begin(path, rate_check_);
}

/// Takes the shapes with which the waiting command was planned, beside those of the profile.
bool Cycle::take_workspace() noexcept {
  const FurtherShapes* const further = queue_.waiting_shapes();
  if (further == nullptr) return false;
  framed_arm_.workspace.count = arm_.workspace.count;
  add_shapes(framed_arm_.workspace, *further);
  return true;
}

/// Checks the knots of a path, if there are any, a few more in each cycle.
std::optional<CommandVerdict> Cycle::check_knots(const Command& next) noexcept {
  const rate::RatePath path = queue_.waiting_rate();
  if (path.knots.empty()) return CommandVerdict{};
  return rate_check_.step(framed_arm_, next, path);
}

SetPoint Cycle::evaluate_path() noexcept {
  if (!is_running_) return set_point_;
  if (governor_.has_path()) return evaluate_rate();
  return evaluate_command(arm_, running_, base_, governor_.virtual_time_s());
}

SetPoint Cycle::evaluate_rate() noexcept {
  const rate::State z = governor_.state();
  SetPoint next{{}, base_.opening};
  std::copy_n(z.begin(), next.position_q.size(), next.position_q.begin());
  const double s = z[rate::kPath];
  const PathPoint point =
      running_.kind == MotionKind::kArc ? point_at(running_.arc, s) : point_at(running_.line, s);
  next.reachable = path_check_.agrees(framed_arm_.kinematics, point, next.position_q);
  return next;
}

void Cycle::complete(std::uint64_t id, Verdict verdict) noexcept {
  queue_.complete(id, verdict, snapshot_.cycle);
  published_ = true;
}

}  // namespace corbot::rt
