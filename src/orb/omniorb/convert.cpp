// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/convert.h"

#include <string_view>

namespace corbot::omni {

Corbot::Pose to_corba(const corbot_tool_pose& tool) {
  const double* const q = tool.orientation;
  return {{tool.position_m[0], tool.position_m[1], tool.position_m[2]}, {q[0], q[1], q[2], q[3]}};
}

corbot_tool_pose from_corba(const Corbot::Pose& pose) {
  const Corbot::Quaternion& q = pose.orientation;
  return {{pose.position.x, pose.position.y, pose.position.z}, {q.w, q.x, q.y, q.z}};
}

Corbot::RobotState to_corba(corbot_state state) {
  switch (state) {
    case CORBOT_STATE_WAITING:
      return Corbot::Waiting;
    case CORBOT_STATE_STANDBY:
      return Corbot::Standby;
    case CORBOT_STATE_ERROR:
      break;
  }
  return Corbot::Error;
}

Corbot::JointCoord to_corba(const double (&joints)[CORBOT_MAX_JOINTS], CORBA::ULong count) {
  Corbot::JointCoord result;
  result.length(count);
  for (CORBA::ULong i = 0; i < count; ++i) result[i] = joints[i];
  return result;
}

Corbot::JointRanges to_corba(const double (&lower)[CORBOT_MAX_JOINTS],
                             const double (&upper)[CORBOT_MAX_JOINTS], CORBA::ULong count) {
  Corbot::JointRanges result;
  result.length(count);
  for (CORBA::ULong i = 0; i < count; ++i) result[i] = {lower[i], upper[i]};
  return result;
}

Corbot::JointList joints_of(const corbot_description& arm) {
  Corbot::JointList result;
  result.length(static_cast<CORBA::ULong>(arm.dof));
  for (CORBA::ULong i = 0; i < result.length(); ++i) {
    result[i].name = CORBA::string_dup(arm.joint_name[i]);
    result[i].kind = arm.slides[i] != 0 ? Corbot::JointSlides : Corbot::JointTurns;
    result[i].range = {arm.lower[i], arm.upper[i]};
    result[i].speed = arm.speed[i];
  }
  return result;
}

Corbot::GripperInfo to_corba(const corbot_gripper_info& gripper) {
  static constexpr Corbot::HoldingState kHolding[] = {Corbot::HoldingUnknown, Corbot::HoldingNo,
                                                      Corbot::HoldingYes};
  return {gripper.commanded_percent, gripper.measured != 0, gripper.opening_percent,
          kHolding[gripper.holding]};
}

void fill(const corbot_motion_info& from, Corbot::MotionInfo& to) {
  static constexpr Corbot::MotionState kStates[] = {Corbot::MotionQueued, Corbot::MotionRunning,
                                                    Corbot::MotionDone, Corbot::MotionStopped,
                                                    Corbot::MotionFailed};
  to.id = from.id;
  to.state = kStates[from.state];
  to.progress = from.progress;
  to.duration = from.duration_s;
  to.reason = CORBA::string_dup(from.reason);
}

void fill(const corbot_device_info& from, Corbot::DeviceInfo& to) {
  static constexpr Corbot::DeviceHealth kHealth[] = {Corbot::DeviceClosed, Corbot::DeviceOpen,
                                                     Corbot::DeviceDegraded, Corbot::DeviceLost};
  to.backend = CORBA::string_dup(from.backend);
  to.health = kHealth[from.health];
  to.cause = from.cause;
  to.causeText = CORBA::string_dup(from.cause_text);
  to.frames = from.frames;
  to.age = from.age_s;
  to.ageMax = from.age_max_s;
  to.measured = from.measured != 0;
  to.measuredAge = from.measured_age_s;
  to.positionUncertain = from.position_unverified != 0;
  to.emergencyStop = from.emergency_stop != 0;
}

void fill(const corbot_plan& from, CORBA::ULong dof, Corbot::PlanInfo& to) {
  to.start = to_corba(from.start, dof);
  to.end = to_corba(from.end, dof);
  to.parts.length(static_cast<CORBA::ULong>(from.part_count));
  for (CORBA::ULong k = 0; k < to.parts.length(); ++k) {
    const corbot_plan_part& part = from.parts[k];
    Corbot::PlanPart& into = to.parts[k];
    into.duration = part.duration_s;
    into.stretches.length(static_cast<CORBA::ULong>(part.stretch_count));
    for (CORBA::ULong i = 0; i < into.stretches.length(); ++i) {
      const corbot_plan_stretch& stretch = part.stretches[i];
      into.stretches[i] = {stretch.begin_s,
                           stretch.end_s,
                           static_cast<Corbot::LimitOwner>(stretch.owner),
                           stretch.joint,
                           static_cast<Corbot::LimitKind>(stretch.limit),
                           stretch.share};
    }
    into.hasPivot = part.has_pivot != 0;
    into.leastPivot = part.least_pivot;
    into.pivotPoint = {part.pivot_point_m[0], part.pivot_point_m[1], part.pivot_point_m[2]};
  }
}

void fill(const corbot_arm_state& from, CORBA::ULong dof, Corbot::ArmState& to) {
  to.cycle = from.cycle;
  to.time = from.time_s;
  to.age = from.age_s;
  to.status = to_corba(from.status);
  to.paused = from.paused != 0;
  to.overridePercent = from.override_percent;
  to.commanded = to_corba(from.commanded, dof);
  to.speeds = to_corba(from.speed, dof);
  to.measured = from.measured != 0;
  to.measuredJoints = to_corba(from.measured_joints, from.measured != 0 ? dof : 0);
  to.tool = to_corba(from.tool);
  to.toolCommanded = to_corba(from.tool_commanded);
  fill(from.motion, to.motion);
  to.queued = from.queued;
  to.gripper = to_corba(from.gripper);
  fill(from.device, to.device);
  to.control.holder = CORBA::string_dup(from.holder.who);
  to.control.left = from.holder.left_s;
  to.control.held = from.held != 0;
}

namespace {

Corbot::Point point_of(const double (&at_m)[3]) { return {at_m[0], at_m[1], at_m[2]}; }
void take_point(const Corbot::Point& point, double (&at_m)[3]) {
  at_m[0] = point.x;
  at_m[1] = point.y;
  at_m[2] = point.z;
}

}  // namespace

void to_corba(const corbot_shape* shapes, std::size_t count, Corbot::WorkspaceShapes& to) {
  to.length(static_cast<CORBA::ULong>(count));
  for (CORBA::ULong i = 0; i < to.length(); ++i) {
    const corbot_shape& from = shapes[i];
    to[i].name = CORBA::string_dup(from.name);
    to[i].kind = static_cast<Corbot::ShapeKind>(from.kind);
    to[i].parts = from.parts;
    to[i].normal = point_of(from.normal);
    to[i].offset = from.offset_m;
    to[i].least = point_of(from.from_m);
    to[i].greatest = point_of(from.to_m);
  }
}

corbot_shape to_shape(const Corbot::WorkspaceShape& shape) {
  corbot_shape to{};
  const std::string_view name = shape.name.in();
  name.copy(to.name, sizeof(to.name) - 1);
  to.kind = static_cast<corbot_shape_kind>(shape.kind);
  to.parts = shape.parts;
  take_point(shape.normal, to.normal);
  to.offset_m = shape.offset;
  take_point(shape.least, to.from_m);
  take_point(shape.greatest, to.to_m);
  return to;
}

}  // namespace corbot::omni
