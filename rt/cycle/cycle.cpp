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

bool has_failed(BackendHealth health) noexcept {
  return health == BackendHealth::kLost || health == BackendHealth::kClosed;
}

}  // namespace

Cycle::Cycle(const ArmModel& arm, const CycleChannel& channel, Backend& backend, const EmergencyStop& stop,
             const CycleStart& start, const LivenessLimits& limits) noexcept
    : arm_(arm),
      task_(channel.task),
      servants_(channel.servants),
      backend_(backend),
      emergency_stop_(stop),
      period_s_(static_cast<double>(arm.period_ns) * 1e-9),
      stops_(channel.stop_count),
      queue_(task_),
      alarms_(task_),
      gap_(arm.period_ns, limits.gap_fault_ns),
      servant_watch_(limits.orphan_ns) {
  adopt_last_position(start);
  snapshot_.stops_done = stops_.newest();
  snapshot_.incarnation = task_.incarnation;
  snapshot_.command_id = 0;
  map_to_pulses(arm_, set_point_.position_rad, set_point_.opening, frame_);
}

void Cycle::adopt_last_position(const CycleStart& start) noexcept {
  for (std::size_t i = 0; i < std::min<std::size_t>(arm_.dof, kMaxJoints); ++i) {
    const double wanted_rad = std::isfinite(start.position_rad[i]) ? start.position_rad[i] : 0.0;
    set_point_.position_rad[i] = std::clamp(wanted_rad, arm_.joints[i].lower_rad, arm_.joints[i].upper_rad);
  }
  if (std::isfinite(start.opening)) set_point_.opening = std::clamp(start.opening, 0.0, 1.0);
  position_.begin(start.unverified, start.power_cut_at_stop);
  snapshot_.position_fingerprint = start.position_fingerprint;
  Snapshot last{};
  if (last_snapshot(task_, last)) {
    snapshot_.cycle = last.cycle;
    queue_.adopt(std::max(last.last_done_id, last.command_id));
    if (!start.outranks_segment && is_in_range(arm_, last.position_rad, kGateTolerance_rad)) {
      set_point_.position_rad = last.position_rad;
      position_.set_unverified((last.flags & kSnapshotUnverified) != 0);
    }
    if (!start.outranks_segment && std::isfinite(last.gripper))
      set_point_.opening = std::clamp(last.gripper, 0.0, 1.0);
    inherit_error(last.state == RtState::kError);
    hold_.adopt((last.flags & kSnapshotHeld) != 0);
  } else {
    queue_.adopt(0);
    hold_.adopt(start.held);
  }
  inherit_error(task_.stop_seen.load(std::memory_order_acquire) != 0);
  gap_inherited_ = start.after_gap;
  faulted_ |= start.after_gap;
  last_ = set_point_;
}

/// Of any kind: it counts as a stop, since it has not been cleared.
void Cycle::inherit_error(bool was_in_error) noexcept {
  if (!was_in_error) return;
  faulted_ = true;
  emergency_latched_ = true;
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
  latch_emergency_stop();
  handle_command();
  advance_virtual_time();
  accept_or_hold(evaluate_path());
  exchange_with_backend();
  publish();
  return {published_ || snapshot_.state != state_before, !is_running_, snapshot_.state};
}

void Cycle::read_flags() noexcept {
  stops_.read(*flags_);
  paused_ = flags_->pause.load(std::memory_order_relaxed) != 0;
  const std::uint64_t clears = flags_->clear_count.load(std::memory_order_acquire);
  if (clears > snapshot_.clears_done) {
    snapshot_.clears_done = clears;
    const bool was_latched = emergency_latched_;
    emergency_latched_ = emergency_latched_ && snapshot_.stop_sources != 0;
    faulted_ = has_failed(health_) || emergency_latched_;
    if (!faulted_) {
      alarms_.clear(clears);
      hold_.clear();
    }
    if (!emergency_latched_) task_.stop_seen.store(0, std::memory_order_release);
    if (was_latched && !emergency_latched_) position_.emergency_stop_cleared();
    published_ = true;
  }
  hold_.see(*flags_);
  published_ = alarms_.report_clear(snapshot_.wall_ns) || published_;
  read_override();
  read_cancel();
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
  snapshot_.override_ratio = position_.limit_override(wanted);
}

void Cycle::report_start() noexcept {
  if (error_inherited_) raise(alarm::error_inherited());
  if (gap_inherited_) raise(alarm::task_replaced());
  error_inherited_ = false;
  gap_inherited_ = false;
}

/// After the flags: a clear that was asked for before the gap does not take it back. At rest as well as in motion:
/// nothing was watched meanwhile, and who stood by has seen an arm that is off.
void Cycle::watch_time() noexcept {
  const Gap gap = gap_.see(snapshot_.time_ns);
  if (gap != Gap::kNone) governor_.restart();
  if (gap == Gap::kFault) fault(alarm::loop_gap(gap_.gap_ns()));
  snapshot_.overruns = overruns_.total();
  const std::uint64_t overruns = overruns_.take_report(snapshot_.time_ns);
  if (overruns > 0) raise(alarm::overrun({.count = overruns, .total = overruns_.total()}));
}

void Cycle::watch_servant() noexcept {
  // Relaxed: the beat says that the servant responds and orders nothing else.
  const std::uint32_t beat = flags_->servant_beat.load(std::memory_order_relaxed);
  if (!servant_watch_.is_silent(beat, gap_.seen_ns(), is_running_ || queue_.is_waiting()) || orphaned_)
    return;
  orphaned_ = true;
  raise(alarm::servant_silent());
}

/// Before any command of this cycle: the set-point of the last cycle is the last.
void Cycle::latch_emergency_stop() noexcept {
  snapshot_.stop_sources = emergency_stop_.sources();
  const std::uint32_t presses = emergency_stop_.presses();
  if (presses == presses_seen_) return;
  presses_seen_ = presses;
  emergency_latched_ = true;
  fault(alarm::emergency_stop(snapshot_.stop_sources));
}

bool Cycle::is_stop_requested() const noexcept {
  return stops_.newest() != snapshot_.stops_done || shutdown_;
}

/// A stop or a Cancel has come since the running command began. It is then stopped even where it can slow
/// down no sooner than at its own end: what its client planned to do next must not follow.
bool Cycle::is_taken_back() const noexcept {
  return stops_.newest() != snapshot_.stops_done || hold_.is_active() || queue_.is_cancelled(running_.id);
}

bool Cycle::is_slowing_down() const noexcept {
  return is_stopping() || (is_running_ && queue_.is_cancelled(running_.id));
}

void Cycle::handle_command() noexcept {
  if (faulted_) {
    orphaned_ = false;
    refuse_queue(Verdict::kFault, false);
    end_stop();
    return;
  }
  if (is_stopping()) {
    end_slowed_down();
    if (is_running_) return;
    if (hold_.is_active()) refuse_queue(Verdict::kStopped, false);
    if (is_stop_requested()) refuse_queue(Verdict::kStopped, !shutdown_);
    if (orphaned_) refuse_queue(Verdict::kOrphaned, false);
    orphaned_ = false;
    end_stop();
    return;
  }
  if (is_slowing_down()) end_slowed_down();
  if (is_running_) return;
  refuse_cancelled();
  if (fetch_command()) begin_command();
}

void Cycle::end_slowed_down() noexcept {
  if (!is_running_ || !governor_.holding()) return;
  is_running_ = false;
  governor_.rest();
  complete(running_.id, is_taken_back() || shutdown_ ? Verdict::kStopped : Verdict::kOrphaned);
}

/// At rest. A hold is an Error from now on.
void Cycle::end_stop() noexcept {
  if (hold_.latch()) fault(alarm::held());
  if (snapshot_.stops_done == stops_.newest()) return;
  snapshot_.stops_done = stops_.newest();
  published_ = true;
}

/// At rest, as refuse_cancelled(). At most two rings full of commands, each with its verdict. `older_only`: up to the
/// first that the stop does not concern.
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

/// At rest. Numbers whose commands are lost end in their turn: no call may wait for them forever.
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
  // Planned from where the task before had the arm, for a caller whose motion was reported lost with it.
  if (next.incarnation != static_cast<std::uint32_t>(snapshot_.incarnation)) return refuse(Verdict::kLost);
  if (paused_) return;

  CommandVerdict verdict =
      check_command(arm_, next, {queue_.last_done(), set_point_.position_rad, set_point_.opening});
  if (next.epoch != stops_.newest()) verdict = {Verdict::kMalformed, -1, static_cast<double>(next.epoch)};
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
  governor_.begin(governed_motion(arm_, running_));
}

void Cycle::advance_virtual_time() noexcept {
  governor_.set_target(paused_ || is_slowing_down() ? 0.0 : snapshot_.override_ratio);
  if (is_running_) governor_.advance(period_s_);
}

SetPoint Cycle::evaluate_path() noexcept {
  return is_running_ ? evaluate_command(arm_, running_, base_, governor_.virtual_time_s()) : set_point_;
}

void Cycle::accept_or_hold(const SetPoint& next) noexcept {
  last_ = set_point_;
  if (!is_running_) return;
  if (!next.reachable) {
    fault(
        alarm::kinematics_failed({.time_s = governor_.virtual_time_s(), .duration_s = running_.duration_s}));
    return;
  }
  const SetPointVerdict verdict =
      check_set_point(arm_, set_point_.position_rad, next.position_rad, next.opening, period_s_);
  if (!verdict.ok) {
    fault(verdict.alarm);
    return;
  }
  set_point_ = next;
  if (!governor_.finished()) return;
  is_running_ = false;
  governor_.rest();
  if (is_taken_back()) {
    complete(running_.id, Verdict::kStopped);
    return;
  }
  position_.motion_done(base_.position_rad, set_point_.position_rad);
  read_override();  // a client that waits for this motion must not read the old one
  complete(running_.id, Verdict::kDone);
}

void Cycle::exchange_with_backend() noexcept {
  frame_.cycle = snapshot_.cycle;
  frame_.time_ns = snapshot_.time_ns;
  frame_.emergency_stop = emergency_latched_;
  map_to_pulses(arm_, set_point_.position_rad, set_point_.opening, frame_);
  backend_.write(frame_);
  const ServoFeedback feedback = backend_.read();
  snapshot_.flags = (feedback.measured ? kSnapshotMeasured : 0u) |
                    (position_.is_unverified() ? kSnapshotUnverified : 0u) |
                    (hold_.is_active() ? kSnapshotHeld : 0u);
  snapshot_.measured_rad = feedback.measured ? feedback.position_rad : Joints{};
  snapshot_.measured_time_ns = feedback.measured ? feedback.time_ns : 0;
  const BackendTimes times = backend_.times();
  snapshot_.device_frames = times.frames;
  snapshot_.device_age_ns = times.age_ns;
  snapshot_.device_age_max_ns = times.age_max_ns;

  const BackendHealth before = health_;
  health_ = backend_.health();
  snapshot_.device_health = static_cast<std::uint32_t>(health_);
  snapshot_.device_cause = to_number(backend_.cause());
  if (health_ == before) return;
  if (has_failed(health_) && !has_failed(before)) {
    fault(alarm::backend_lost(backend_.cause()));
  } else if (health_ == BackendHealth::kDegraded) {
    raise(alarm::backend_degraded(backend_.cause()));
  }
}

/// The arm holds its last good set-point; what runs and what waits gets its verdict in this cycle.
void Cycle::fault(const AlarmEvent& cause) noexcept {
  raise(cause);
  faulted_ = true;
  if (is_running_) {
    is_running_ = false;
    governor_.rest();
    complete(running_.id, Verdict::kFault);
  }
  refuse_queue(Verdict::kFault, false);
}

void Cycle::raise(const AlarmEvent& alarm) noexcept {
  alarms_.raise(alarm, snapshot_.wall_ns);
  published_ = true;
}

void Cycle::complete(std::uint64_t id, Verdict verdict) noexcept {
  queue_.complete(id, verdict, snapshot_.cycle);
  published_ = true;
}

RtState Cycle::state() const noexcept {
  if (faulted_) return RtState::kError;
  if (is_slowing_down()) return RtState::kStopping;
  if (paused_ && (!is_running_ || governor_.holding())) return RtState::kPaused;
  return is_running_ ? RtState::kMoving : RtState::kStandby;
}

void Cycle::publish() noexcept {
  snapshot_.state = state();
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
