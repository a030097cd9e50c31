// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/cycle.h"

#include <algorithm>
#include <cmath>

#include "corbot/channel/alarms.h"
#include "rt/cycle/command_check.h"
#include "rt/cycle/servo_map.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

/// Returns the rate at which the device keeps up. It is in steps, so that a varying ratio does not begin a
/// ramp in every cycle.
double device_ratio(const BackendTimes& times) noexcept {
  constexpr double kSteps = 32.0;
  if (!(times.speed_ratio < 1.0)) return 1.0;
  return std::max(std::floor(times.speed_ratio * kSteps), 1.0) / kSteps;
}

}  // namespace

Cycle::Cycle(const ArmModel& arm, const CycleChannel& channel, Backend& backend, EmergencyStop& stop,
             const CycleStart& start, const CycleSettings& settings) noexcept
    : arm_(arm),
      task_(channel.task),
      servants_(channel.servants),
      backend_(backend),
      period_s_(static_cast<double>(arm.period_ns) * 1e-9),
      settle_ns_(settings.settle_ns),
      ramp_ns_(settings.ramp_ns),
      stops_(channel.stop_count),
      queue_(task_),
      alarms_(task_),
      gap_(arm.period_ns, settings.liveness.gap_fault_ns),
      servant_watch_(settings.liveness.orphan_ns),
      stop_watch_(stop),
      fault_stop_(settings.stop_category),
      joint_ramp_(arm),
      following_(settings.following) {
  adopt_last_position(start);
  snapshot_.stops_done = stops_.newest();
  snapshot_.incarnation = task_.incarnation;
  snapshot_.command_id = 0;
  frame_.cycle = snapshot_.cycle;  // a device's thread counts the cycles since its first frame
  frame_.needs_clear = fault_stop_.is_latched();
  frame_.power_off = fault_stop_.power_off();
  map_to_pulses(arm_, set_point_.position_q, set_point_.opening, frame_);
}

void Cycle::adopt_last_position(const CycleStart& start) noexcept {
  for (std::size_t i = 0; i < std::min<std::size_t>(arm_.dof, kMaxJoints); ++i) {
    const double wanted_q = std::isfinite(start.position_q[i]) ? start.position_q[i] : 0.0;
    set_point_.position_q[i] = std::clamp(wanted_q, arm_.joints[i].lower_q, arm_.joints[i].upper_q);
  }
  if (std::isfinite(start.opening)) set_point_.opening = std::clamp(start.opening, 0.0, 1.0);
  position_.begin(start.unverified, start.position_known);
  snapshot_.position_fingerprint = start.position_fingerprint;
  Snapshot last{};
  if (last_snapshot(task_, last)) {
    snapshot_.cycle = last.cycle;
    queue_.adopt(std::max(last.last_done_id, last.command_id));
    if (!start.outranks_segment && is_in_range(arm_, last.position_q, kGateTolerance_q)) {
      set_point_.position_q = last.position_q;
      position_.set_unverified((last.flags & kSnapshotUnverified) != 0);
    }
    if (!start.outranks_segment && std::isfinite(last.gripper))
      set_point_.opening = std::clamp(last.gripper, 0.0, 1.0);
    inherit_error(start.was_moved || last.state == RtState::kError);
    hold_.adopt((last.flags & kSnapshotHeld) != 0);
  } else {
    queue_.adopt(0);
    inherit_error(start.in_error);
    hold_.adopt(start.held);
  }
  inherit_error(task_.stop_seen.load(std::memory_order_acquire) != 0);
  gap_inherited_ = start.after_gap;
  if (start.after_gap) fault_stop_.begin(FaultStop::Way::kAtOnce, false);
  last_ = set_point_;
  joint_ramp_.rest_at(set_point_.position_q);
}

/// Inherits an Error of any kind: it counts as a stop, since it has not been cleared.
void Cycle::inherit_error(bool was_in_error) noexcept {
  if (!was_in_error) return;
  fault_stop_.begin(FaultStop::Way::kAtOnce, false);
  error_inherited_ = true;
}

StepReport Cycle::step(std::int64_t now_ns, std::int64_t wall_ns) noexcept {
  const RtState state_before = snapshot_.state;
  snapshot_.time_ns = now_ns;
  snapshot_.wall_ns = wall_ns;
  ++snapshot_.cycle;
  published_ = false;

  if (const ServantOffer* const offer = servants_.take(); offer != nullptr) connect(*offer);
  read_flags();
  report_start();
  watch_time();
  watch_servant();
  watch_stop_input();
  handle_command();
  advance_virtual_time();
  accept_or_ramp(evaluate_path());
  exchange_with_backend();
  check_following();
  end_settled();
  publish();
  return {published_ || snapshot_.state != state_before, !is_running_ && !fault_stop_.is_slowing_down(),
          snapshot_.state};
}

void Cycle::read_flags() noexcept {
  stops_.read(*flags_);
  paused_ = flags_->pause.load(std::memory_order_relaxed) != 0;
  read_clear();
  hold_.see(*flags_);
  published_ = alarms_.report_clear(snapshot_.wall_ns) || published_;
  read_override();
  read_cancel();
}

/// Carries out a Clear. An arm that still slows down, or whose device has failed, is not cleared; another
/// Clear may do so later. The same holds while a stop is pressed. A refused Clear changes nothing.
void Cycle::read_clear() noexcept {
  const std::uint64_t clears = flags_->clear_count.load(std::memory_order_acquire);
  if (clears <= snapshot_.clears_done) return;
  snapshot_.clears_done = clears;
  published_ = true;
  if (fault_stop_.is_slowing_down() || stop_watch_.forbids_clear() || has_failed(device_.health())) return;
  const bool was_in_error = fault_stop_.is_latched();
  follow_device();  // a Clear in the first cycle of standing by leaves no later one for it
  if (fault_stop_.is_latched() && !was_in_error) return;  // it has raised the alarm
  if (beyond_range_) return raise(alarm::joint_beyond_range(*beyond_range_));
  if (fault_stop_.power_off()) position_.energy_returns(feedback_.measured);
  task_.stop_seen.store(0, std::memory_order_release);
  fault_stop_.release();
  if (was_in_error) stands_ = false;
  alarms_.clear(clears);
  hold_.clear();
}

void Cycle::read_cancel() noexcept {
  CancelRequest request{};
  if (!flags_->cancel.try_load(request) || request.count == snapshot_.cancels_done) return;
  snapshot_.cancels_done = request.count;
  queue_.cancel(request);
  published_ = true;
}

void Cycle::read_override() noexcept {
  const double wanted = Governor::valid_rate(flags_->override_ratio.load(std::memory_order_relaxed));
  snapshot_.override_ratio = std::min(position_.limit_override(wanted), device_ratio(device_.times()));
}

void Cycle::report_start() noexcept {
  if (error_inherited_) raise(alarm::error_inherited());
  if (gap_inherited_) raise(alarm::task_replaced());
  error_inherited_ = false;
  gap_inherited_ = false;
}

/// Detects gaps and overruns. It runs after the flags: a Clear requested before the gap does not end the
/// fault. It acts at rest as well as in motion. Nothing was watched meanwhile, and a bystander has seen an
/// arm that is off.
void Cycle::watch_time() noexcept {
  const Gap gap = gap_.see(snapshot_.time_ns);
  if (gap != Gap::kNone) {
    governor_.restart();
    differences_.begin(set_point_.position_q);
    joint_ramp_.rest_at(set_point_.position_q);
    if (fault_stop_.is_by_joint()) fault_stop_.come_to_rest();
  }
  if (gap == Gap::kFault) fault(alarm::loop_gap(gap_.gap_ns()), FaultStop::Way::kAtOnce);
  snapshot_.overruns = overruns_.total();
  const std::uint64_t overruns = overruns_.take_report(snapshot_.time_ns);
  if (overruns > 0) raise(alarm::overrun({.count = overruns, .total = overruns_.total()}));
}

void Cycle::watch_servant() noexcept {
  // Relaxed: the beat shows that the servant responds and orders nothing else.
  const std::uint32_t beat = flags_->servant_beat.load(std::memory_order_relaxed);
  if (!servant_watch_.is_silent(beat, gap_.seen_ns(), is_running_ || queue_.is_waiting()) || orphaned_)
    return;
  orphaned_ = true;
  raise(alarm::servant_silent());
}

/// Runs before any command of this cycle, and before the motion advances: the ramp begins in the cycle that
/// sees the press.
void Cycle::watch_stop_input() noexcept {
  const bool is_pressed = stop_watch_.see(gap_.seen_ns());
  snapshot_.stop_sources = stop_watch_.sources();
  if (is_pressed) fault(alarm::emergency_stop(snapshot_.stop_sources), FaultStop::Way::kOnPath);
}

bool Cycle::is_stop_requested() const noexcept {
  return stops_.newest() != snapshot_.stops_done || shutdown_;
}

/// Tells whether a stop or a Cancel has come since the running command began. The command is then stopped
/// even if it can slow down no sooner than at its own end: its client's next motion must not follow.
bool Cycle::is_taken_back() const noexcept {
  return stops_.newest() != snapshot_.stops_done || hold_.is_active() || queue_.is_cancelled(running_.id);
}

bool Cycle::is_slowing_down() const noexcept {
  return fault_stop_.is_slowing_down() || is_stopping() || (is_running_ && queue_.is_cancelled(running_.id));
}

void Cycle::advance_virtual_time() noexcept {
  governor_.set_target(paused_ || is_slowing_down() ? 0.0 : snapshot_.override_ratio);
  if (is_running_) governor_.advance(period_s_);
}

void Cycle::accept_or_ramp(const SetPoint& next) noexcept {
  last_ = set_point_;
  if (fault_stop_.is_by_joint()) return step_by_joint();
  if (!is_running_) return follow_device();
  if (!next.reachable) {
    fault(alarm::kinematics_failed({.time_s = governor_.virtual_time_s(), .duration_s = running_.duration_s}),
          FaultStop::Way::kByJoint);
    return step_by_joint();
  }
  SetPointVerdict verdict =
      check_set_point(arm_, set_point_.position_q, next.position_q, next.opening, period_s_);
  if (verdict.ok && governor_.has_path()) verdict = differences_.see(arm_, next.position_q, period_s_);
  if (verdict.ok) verdict = workspace_check_.see(framed_arm_, next.position_q);
  if (!verdict.ok) {
    fault(verdict.alarm, FaultStop::Way::kByJoint);
    return step_by_joint();
  }
  set_point_ = next;
  joint_ramp_.see(set_point_.position_q);
  if (!governor_.finished() || settling_.is_active() || fault_stop_.is_slowing_down()) return;
  if (!is_taken_back()) settling_.begin(snapshot_.cycle);
}

/// Takes a step of the joints' ramps; the gripper stays at its opening.
void Cycle::step_by_joint() noexcept {
  if (!fault_stop_.is_by_joint()) return;
  set_point_.position_q = joint_ramp_.next();
  joint_ramp_.see(set_point_.position_q);
}

/// Tells whether the joints follow the device's report instead of set-points. Measured joints do so also
/// while they are being energised after a Clear.
bool Cycle::is_led_by_device() const noexcept {
  const bool is_standing_by = device_.health() == BackendHealth::kStandby;
  const bool leads = fault_stop_.is_latched() ? is_standing_by || fault_stop_.power_off()
                                              : is_standing_by && (stands_ || feedback_.measured);
  return leads && (feedback_.measured || (is_standing_by && feedback_.commanded));
}

/// Follows the device. Servos without energy go where they are pushed. If the device cannot tell whether they
/// have any, a small difference is their lag: following it would let the arm creep. A joint found beyond its
/// range after the Clear has no set-point at its position.
void Cycle::follow_device() noexcept {
  constexpr double kBehind_rad = 0.02;
  const bool is_standing_by = device_.health() == BackendHealth::kStandby;
  const bool follows = is_led_by_device();
  if (!fault_stop_.is_latched()) beyond_range_.reset();
  if (follows) {  // otherwise the last report counts
    beyond_range_ = beyond_range(arm_, feedback_.position_q,
                                 feedback_.measured ? kNearRangeMeasured_rad : kNearRangeCommanded_rad);
  }
  if (beyond_range_ && feedback_.measured && !fault_stop_.is_latched())
    fault(alarm::joint_beyond_range(*beyond_range_), FaultStop::Way::kAtOnce);
  for (std::size_t i = 0; follows && i < std::min<std::size_t>(arm_.dof, kMaxJoints); ++i) {
    const double there_q = feedback_.position_q[i];
    double& held_q = set_point_.position_q[i];
    if (!std::isfinite(there_q)) continue;
    if (!is_standing_by && std::abs(there_q - held_q) <= near_q(arm_.kinematics.joint_kind(i), kBehind_rad))
      continue;
    held_q = std::clamp(there_q, arm_.joints[i].lower_q, arm_.joints[i].upper_q);
    last_.position_q[i] = held_q;  // not by a set-point's speed
  }
  constexpr double kBehind = 0.02;
  const double opening = follows ? feedback_.opening : -1.0;  // if it is no number, nothing follows either
  if (opening >= 0.0 && (is_standing_by || std::abs(opening - set_point_.opening) > kBehind))
    set_point_.opening = std::min(opening, 1.0);
  if (follows) stands_ = false;
  joint_ramp_.rest_at(set_point_.position_q);
}

void Cycle::exchange_with_backend() noexcept {
  frame_.cycle = snapshot_.cycle;
  frame_.time_ns = snapshot_.time_ns;
  frame_.needs_clear = fault_stop_.is_latched();
  frame_.power_off = fault_stop_.power_off();
  if (set_point_.position_q != last_.position_q || set_point_.opening != last_.opening)
    moved_in_ = snapshot_.cycle;
  map_to_pulses(arm_, set_point_.position_q, set_point_.opening, frame_);
  backend_.write(frame_);
  // Before the feedback, which a device that stands by has given already.
  device_.look(backend_, frame_, gap_.seen_ns());
  feedback_ = has_failed(device_.health()) ? ServoFeedback{} : backend_.read();
  rest_.see(feedback_, gap_.seen_ns());
  grip_.see(set_point_.opening, feedback_, is_device_open(), gap_.seen_ns());
  snapshot_.measured_q = feedback_.measured ? feedback_.position_q : Joints{};
  snapshot_.measured_time_ns = feedback_.measured ? feedback_.time_ns : 0;
  snapshot_.measured_opening = feedback_.measured ? feedback_.opening : -1.0;
  const BackendTimes& times = device_.times();
  snapshot_.device_frames = times.frames;
  snapshot_.device_age_ns = times.age_ns;
  snapshot_.device_age_max_ns = times.age_max_ns;
  snapshot_.device_health = static_cast<std::uint32_t>(device_.health());
  snapshot_.device_cause = to_number(device_.cause());
  if (device_.has_changed()) watch_device();
}

/// Reports changes of the device. A motion that has begun does not go on without energy, for whatever reason
/// it went off.
void Cycle::watch_device() noexcept {
  const bool ends_motion = is_running_ && device_.health() == BackendHealth::kStandby && !frame_.needs_clear;
  if (device_.has_fallen() || device_.is_newly_lost() || ends_motion) {
    fault(alarm::backend_lost(device_.cause()), FaultStop::Way::kAtOnce);
  } else if (device_.health() == BackendHealth::kDegraded) {
    raise(alarm::backend_degraded(device_.cause()));
  }
}

void Cycle::check_following() noexcept {
  if (!is_device_open() || fault_stop_.takes_energy()) return following_.rest();
  const auto deviation = following_.see(set_point_.position_q, feedback_, gap_.seen_ns());
  if (deviation) fault(alarm::following_error(*deviation), FaultStop::Way::kOnPath);
}

/// Ends a motion in the cycle in which the device has taken the last set-point and, if it measures, the
/// joints are there. Measured fingers have gone as far as they can: closing on something is no fault, nor is
/// a longer closing time.
void Cycle::end_settled() noexcept {
  if (!settling_.is_active() || fault_stop_.is_latched() || is_taken_back()) return;
  const bool moves_joints = running_.kind != MotionKind::kGripper && running_.kind != MotionKind::kDwell;
  const bool is_taken = running_.kind == MotionKind::kDwell || settling_.is_taken(device_.times());
  const auto off_goal = moves_joints ? following_.off_goal(set_point_.position_q, feedback_) : std::nullopt;
  // Encoders that report nothing do not prove that the joints are there.
  const bool is_said = feedback_.measured || !backend_.has_encoders() || !moves_joints;
  const bool has_gripped =
      running_.kind != MotionKind::kGripper || !grip_.is_measured() || grip_.is_at_rest();
  if (is_taken && is_said && !off_goal && has_gripped) {
    position_.motion_done(base_.position_q, set_point_.position_q);
    read_override();  // a client that waits for this motion must not read the old override
    return end_motion(Verdict::kDone);
  }
  if (!settling_.wait(gap_.seen_ns(), settle_ns_)) return;
  if (!has_gripped && is_taken) return end_motion(Verdict::kDone);
  fault(alarm::goal_not_reached(
            off_goal.value_or(alarm::JointDeviation{.joint = -1, .error_q = 0.0, .allowed_q = 0.0})),
        FaultStop::Way::kOnPath);
}

/// Tells whether set-points are moving, or joints or a device lag behind resting ones, whatever has ended the
/// motion. Powered joints must decelerate before power-off; unpowered joints are not powered for that.
bool Cycle::has_to_be_awaited() const noexcept {
  if (is_running_ && !settling_.is_active()) return true;
  if (!is_running_ && (!is_device_open() || fault_stop_.power_off())) return false;
  return !have_joints_come_to_rest() || !has_device_seen_rest();
}

/// Begins a fault. A motion that has already come to rest gets its verdict in this cycle.
void Cycle::fault(const AlarmEvent& cause, FaultStop::Way way) noexcept {
  raise(cause);
  const bool was_by_joint = fault_stop_.is_by_joint();
  if (!fault_stop_.is_slowing_down()) fault_ran_ns_ = 0;
  fault_stop_.begin(way, has_to_be_awaited());
  if (fault_stop_.is_by_joint() && !was_by_joint) joint_ramp_.begin();
  if (!fault_stop_.is_slowing_down()) end_fault();
}

void Cycle::raise(const AlarmEvent& alarm) noexcept {
  alarms_.raise(alarm, snapshot_.wall_ns);
  published_ = true;
}

RtState Cycle::state() const noexcept {
  if (fault_stop_.is_latched()) return RtState::kError;
  if (is_slowing_down()) return RtState::kStopping;
  if (paused_ && (!is_running_ || governor_.holding())) return RtState::kPaused;
  return is_running_ || is_device_starting() ? RtState::kMoving : RtState::kStandby;
}

void Cycle::publish() noexcept {
  snapshot_.state = state();
  snapshot_.flags =
      (feedback_.measured ? kSnapshotMeasured : 0u) | (position_.is_unverified() ? kSnapshotUnverified : 0u) |
      (hold_.is_active() ? kSnapshotHeld : 0u) | (fault_stop_.power_off() ? kSnapshotPowerOff : 0u) |
      (fault_stop_.is_slowing_down() ? kSnapshotFaultStop : 0u) | (paused_ ? kSnapshotPaused : 0u) |
      grip_.snapshot_flag();
  snapshot_.command_id = is_running_ ? running_.id : 0;
  snapshot_.command_duration_s = is_running_ ? running_.duration_s : 0.0;
  snapshot_.last_done_id = queue_.last_done();
  snapshot_.holds_done = hold_.done();
  snapshot_.backlog = static_cast<std::uint32_t>(queue_.backlog());
  snapshot_.waiting_id = queue_.is_waiting() ? queue_.waiting().id : 0;
  snapshot_.virtual_time_s = is_running_ ? governor_.virtual_time_s() : 0.0;
  snapshot_.virtual_rate = is_running_ ? governor_.rate() : 0.0;
  publish_set_point(arm_, set_point_, last_, snapshot_);
  snapshot_.pulse_us = frame_.pulse_us;
  task_.snapshot.store(snapshot_);
  task_.trace.append(snapshot_);
}

}  // namespace corbot::rt
