// SPDX-License-Identifier: Apache-2.0
#include "robot/robot_view.h"

#include <algorithm>
#include <chrono>

#include "corbot/arm/joint_units.h"
#include "corbot/backend/backend.h"
#include "corbot/kinematics/pose.h"
#include "corbot/kinematics/tool_pose.h"
#include "planner/frame_settings.h"

namespace corbot {
namespace {

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

std::int64_t monotonic_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

bool is_measured(const Snapshot& snapshot) { return (snapshot.flags & kSnapshotMeasured) != 0; }

/// Returns true if the cause is over once the device answers again. A drive without torque answers, but still
/// has no torque.
bool is_over_once_it_answers(DeviceCause cause) {
  switch (cause) {
    case DeviceCause::kDeviceFault:
    case DeviceCause::kTorqueOff:
    case DeviceCause::kDisabled:
    case DeviceCause::kTargetIgnored:
    case DeviceCause::kCountChanged:
      return false;
    default:
      return true;
  }
}

/// Describes why the device does not take set-points as it should. Standby has no value in DeviceHealth: the
/// text says what a device on standby waits for, and gives the cause that is over.
std::string cause_text(const Snapshot& snapshot) {
  const DeviceCause code = to_device_cause(snapshot.device_cause);
  std::string cause = device_cause_text(code);
  const bool is_standby = snapshot.device_health == static_cast<std::uint32_t>(BackendHealth::kStandby);
  if (!is_standby || !is_over_once_it_answers(code)) return cause;
  const std::string waits =
      snapshot.state == RtState::kError ? "no energy until Clear" : "its servos are being energised";
  return cause.empty() ? waits : waits + " (after: " + cause + ")";
}

double ratio_of(double elapsed_s, double duration_s) {
  return duration_s > 0.0 ? std::clamp(elapsed_s / duration_s, 0.0, 1.0) : 0.0;
}

/// Returns the progress of a motion that has begun.
double progress_of(const Snapshot& now, const Ticket& ticket) {
  const bool second = now.last_done_id >= ticket.first && ticket.first != ticket.last;
  return ratio_of((second ? ticket.second_from_s : 0.0) + now.virtual_time_s, ticket.duration_s);
}

/// Returns the pose with w of the quaternion not negative.
corbot_tool_pose pose_of(const Pose& tool) {
  Quaternion turned = normalised(tool.orientation);
  if (turned.w < 0.0) turned = {-turned.w, -turned.x, -turned.y, -turned.z};
  return {{tool.position_m[0], tool.position_m[1], tool.position_m[2]},
          {turned.w, turned.x, turned.y, turned.z}};
}

corbot_gripper_info gripper_of(const Snapshot& now) {
  corbot_gripper_info info{};
  // Adding 0.0 changes only a negative zero.
  info.commanded_percent = info.opening_percent = 100.0 * now.gripper + 0.0;
  info.measured = is_measured(now) && now.measured_opening >= 0.0 ? 1 : 0;
  if (info.measured != 0) info.opening_percent = 100.0 * now.measured_opening + 0.0;
  if ((now.flags & kSnapshotHoldsNothing) != 0) info.holding = CORBOT_HOLDING_NO;
  if ((now.flags & kSnapshotHolding) != 0) info.holding = CORBOT_HOLDING_YES;
  return info;
}

}  // namespace

Snapshot RobotView::snapshot() const {
  Snapshot now{};
  if (!link_.snapshot(now)) throw no_data(link_.cause());
  return now;
}

Joints RobotView::joints_shown() const {
  const Snapshot now = snapshot();
  Joints joints = is_measured(now) ? now.measured_q : now.position_q;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i)
    joints[i] = to_shown(profile_.arm.kinematics.joint_kind(i), joints[i]);
  return joints;
}

corbot_pose RobotView::pose() const {
  const Snapshot now = snapshot();
  const ToolPose tool = tool_pose(in_frames(profile_.arm.kinematics, settings_.get()),
                                  is_measured(now) ? now.measured_q : now.position_q);
  return {tool.position_m[0],       tool.position_m[1],         tool.position_m[2],
          to_degrees(tool.yaw_rad), to_degrees(tool.pitch_rad), to_degrees(tool.roll_rad)};
}

corbot_gripper RobotView::gripper() const {
  Snapshot now{};
  if (!link_.snapshot(now)) return CORBOT_GRIPPER_CLOSE;
  return now.gripper >= 0.5 ? CORBOT_GRIPPER_OPEN : CORBOT_GRIPPER_CLOSE;
}

corbot_state RobotView::state_of(const Snapshot& now, std::size_t pending) const {
  if (!link_.alive() || watch_.is_frozen() || now.state == RtState::kError) return CORBOT_STATE_ERROR;
  return now.state == RtState::kStandby && pending == 0 ? CORBOT_STATE_STANDBY : CORBOT_STATE_WAITING;
}

corbot_state RobotView::state() const {
  Snapshot now{};
  return link_.snapshot(now) ? state_of(now, tickets_.pending()) : CORBOT_STATE_ERROR;
}

double RobotView::cycle_age_s() const { return std::max(seconds(monotonic_ns() - snapshot().time_ns), 0.0); }

LoopDiagnostics RobotView::diagnostics() const {
  const auto channel = link_.channel();
  LoopDiagnostics diagnostics{};
  if (!channel || !channel->task().diagnostics.load(diagnostics)) {
    throw no_data("the real-time loop has not reported anything yet");
  }
  return diagnostics;
}

corbot_device_info RobotView::device() const { return device_of(snapshot(), monotonic_ns()); }

corbot_device_info RobotView::device_of(const Snapshot& now, std::int64_t from_ns) const {
  corbot_device_info info{};
  copy_text(profile_.backend.kind, info.backend, sizeof(info.backend));
  info.position_unverified = (now.flags & kSnapshotUnverified) != 0 ? 1 : 0;
  info.frames = now.device_frames;
  info.age_s = seconds(now.device_age_ns);
  info.age_max_s = seconds(now.device_age_max_ns);
  if (!link_.alive()) return info;  // closed: the last task's view of the device is out of date
  if (now.device_health <= static_cast<std::uint32_t>(BackendHealth::kLost))
    info.health = static_cast<corbot_device_health>(now.device_health);
  info.cause = now.device_cause;
  copy_text(cause_text(now), info.cause_text, sizeof(info.cause_text));
  info.measured = is_measured(now) ? 1 : 0;
  if (is_measured(now)) info.measured_age_s = std::max(seconds(from_ns - now.measured_time_ns), 0.0);
  info.emergency_stop = now.stop_sources != 0 ? 1 : 0;
  return info;
}

double RobotView::override_percent() const {
  Snapshot now{};
  return link_.snapshot(now) ? 100.0 * now.override_ratio : 100.0;
}

std::vector<AlarmEntry> RobotView::alarms() const {
  link_.await_alarms();
  std::vector<AlarmEntry> list = alarms_.list();
  if (!watch_.is_frozen()) return list;
  for (AlarmEntry& entry : list) {
    if (entry.active && entry.code == kAlarmTaskFrozen)
      entry.text = watch_.cause();  // gives the duration so far
  }
  return list;
}

bool RobotView::paused() const {
  const auto channel = link_.channel();
  return channel && channel->own().control.pause.load(std::memory_order_relaxed) != 0;
}

bool RobotView::held() const {
  Snapshot now{};
  return is_held(link_.snapshot(now) ? &now : nullptr);
}

bool RobotView::is_held(const Snapshot* now) const {
  const ControlFlags& flags = link_.own().control;
  const std::uint64_t count = flags.hold_count.load(std::memory_order_acquire);
  if (now != nullptr && (now->flags & kSnapshotHeld) != 0) return true;
  // A connected task knows better than the counts, once it has seen the last request.
  if (link_.alive() && now != nullptr) return now->holds_done < count;
  return count != flags.holds_cleared.load(std::memory_order_acquire);
}

corbot_motion_info RobotView::describe(const Ticket& ticket) const {
  corbot_motion_info info{};
  info.id = ticket.last;
  info.duration_s = ticket.duration_s;
  copy_text(ticket.reason, info.reason, sizeof(info.reason));
  switch (ticket.state) {
    case TicketState::kDone:
      info.state = CORBOT_MOTION_DONE;
      info.progress = 1.0;
      return info;
    case TicketState::kStopped:
      info.state = CORBOT_MOTION_STOPPED;
      return info;
    case TicketState::kFailed:
      info.state = CORBOT_MOTION_FAILED;
      return info;
    case TicketState::kPending:
      break;
  }
  info.state = CORBOT_MOTION_QUEUED;
  Snapshot now{};
  if (!link_.snapshot(now) || std::max(now.command_id, now.last_done_id) < ticket.first) return info;
  info.state = CORBOT_MOTION_RUNNING;
  info.progress = progress_of(now, ticket);
  return info;
}

corbot_motion_info RobotView::motion_of(const Snapshot& now, const std::optional<Ticket>& ticket) const {
  corbot_motion_info info{};
  if (now.command_id == 0 && !ticket) return info;
  info.state = CORBOT_MOTION_RUNNING;
  info.id = ticket ? ticket->last
                   : now.command_id;  // without a ticket: a motion of a servant with unreadable records
  info.duration_s = ticket ? ticket->duration_s : now.command_duration_s;
  info.progress = ticket ? progress_of(now, *ticket) : ratio_of(now.virtual_time_s, now.command_duration_s);
  return info;
}

corbot_arm_state RobotView::arm_state() const {
  const Snapshot now = snapshot();
  const TicketTable::Shown shown = tickets_.shown_in(now);
  corbot_arm_state all{};
  all.cycle = now.cycle;
  all.time_s = seconds(now.wall_ns);
  all.age_s = std::max(seconds(monotonic_ns() - now.time_ns), 0.0);
  all.status = state_of(now, shown.queued + (shown.running ? 1 : 0));
  all.paused = (now.flags & kSnapshotPaused) != 0 ? 1 : 0;
  all.held = is_held(&now) ? 1 : 0;
  all.override_percent = 100.0 * now.override_ratio;
  all.measured = is_measured(now) ? 1 : 0;
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const JointKind kind = profile_.arm.kinematics.joint_kind(i);
    all.commanded[i] = to_shown(kind, now.position_q[i]);
    all.speed[i] = to_shown(kind, now.velocity_q_s[i]);
    if (is_measured(now)) all.measured_joints[i] = to_shown(kind, now.measured_q[i]);
  }
  const Kinematics arm = in_frames(profile_.arm.kinematics, settings_.get());
  all.tool_commanded = pose_of(arm.forward(now.position_q));
  all.tool = is_measured(now) ? pose_of(arm.forward(now.measured_q)) : all.tool_commanded;
  all.motion = motion_of(now, shown.running);
  all.queued = static_cast<std::uint32_t>(shown.queued);
  all.gripper = gripper_of(now);
  all.device = device_of(now, now.time_ns);
  return all;
}

std::string RobotView::error_cause() const {
  if (!link_.alive()) return link_.cause();
  if (watch_.is_frozen()) return watch_.cause();
  link_.await_alarms();
  const std::string cause = alarms_.cause();
  if (alarms_.is_hold_alone()) return cause + "; nothing is faulty: 'corbot clear' ends the hold";
  return cause.empty() ? "the robot is in Error; clear it" : cause + "; fix the cause, then clear";
}

}  // namespace corbot
