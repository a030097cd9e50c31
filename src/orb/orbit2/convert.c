/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/convert.h"

Corbot_RobotState convert_state(corbot_state state) {
  switch (state) {
    case CORBOT_STATE_WAITING:
      return Corbot_Waiting;
    case CORBOT_STATE_STANDBY:
      return Corbot_Standby;
    case CORBOT_STATE_ERROR:
      break;
  }
  return Corbot_Error;
}

void convert_joints(const double joints[CORBOT_MAX_JOINTS], int32_t count, Corbot_JointCoord* to) {
  const CORBA_unsigned_long length = (CORBA_unsigned_long)count;
  to->_buffer = Corbot_JointCoord_allocbuf(length);
  to->_length = to->_maximum = length;
  to->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < length; ++i) to->_buffer[i] = joints[i];
}

Corbot_GripperInfo convert_gripper(const corbot_gripper_info* gripper) {
  static const Corbot_HoldingState holding[] = {Corbot_HoldingUnknown, Corbot_HoldingNo, Corbot_HoldingYes};
  const Corbot_GripperInfo result = {gripper->commanded_percent, gripper->measured ? CORBA_TRUE : CORBA_FALSE,
                                     gripper->opening_percent, holding[gripper->holding]};
  return result;
}

void convert_motion(const corbot_motion_info* from, Corbot_MotionInfo* to) {
  static const Corbot_MotionState states[] = {Corbot_MotionQueued, Corbot_MotionRunning, Corbot_MotionDone,
                                              Corbot_MotionStopped, Corbot_MotionFailed};
  to->id = from->id;
  to->state = states[from->state];
  to->progress = from->progress;
  to->duration = from->duration_s;
  to->reason = CORBA_string_dup(from->reason);
}

void convert_device(const corbot_device_info* from, Corbot_DeviceInfo* to) {
  static const Corbot_DeviceHealth health[] = {Corbot_DeviceClosed, Corbot_DeviceOpen, Corbot_DeviceDegraded,
                                               Corbot_DeviceLost};
  to->backend = CORBA_string_dup(from->backend);
  to->health = health[from->health];
  to->cause = from->cause;
  to->causeText = CORBA_string_dup(from->cause_text);
  to->frames = from->frames;
  to->age = from->age_s;
  to->ageMax = from->age_max_s;
  to->measured = from->measured ? CORBA_TRUE : CORBA_FALSE;
  to->measuredAge = from->measured_age_s;
  to->positionUncertain = from->position_unverified ? CORBA_TRUE : CORBA_FALSE;
  to->emergencyStop = from->emergency_stop ? CORBA_TRUE : CORBA_FALSE;
}

Corbot_Pose convert_pose(const corbot_tool_pose* tool) {
  const double* q = tool->orientation;
  const Corbot_Pose result = {{tool->position_m[0], tool->position_m[1], tool->position_m[2]},
                              {q[0], q[1], q[2], q[3]}};
  return result;
}

corbot_tool_pose convert_to_pose(const Corbot_Pose* pose) {
  const Corbot_Point* p = &pose->position;
  const Corbot_Quaternion* q = &pose->orientation;
  const corbot_tool_pose result = {{p->x, p->y, p->z}, {q->w, q->x, q->y, q->z}};
  return result;
}

static void convert_stretches(const corbot_plan_part* from, Corbot_PlanStretches* to) {
  static const Corbot_LimitOwner owners[] = {Corbot_OwnerArticulation, Corbot_OwnerTool,
                                             Corbot_OwnerToolTurn};
  static const Corbot_LimitKind limits[] = {Corbot_LimitSpeed, Corbot_LimitAcceleration, Corbot_LimitJerk};
  const CORBA_unsigned_long length = (CORBA_unsigned_long)from->stretch_count;
  to->_buffer = Corbot_PlanStretches_allocbuf(length);
  to->_length = to->_maximum = length;
  to->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < length; ++i) {
    const corbot_plan_stretch* stretch = &from->stretches[i];
    const Corbot_PlanStretch result = {stretch->begin_s, stretch->end_s,         owners[stretch->owner],
                                       stretch->joint,   limits[stretch->limit], stretch->share};
    to->_buffer[i] = result;
  }
}

void convert_plan(const corbot_plan* from, int32_t dof, Corbot_PlanInfo* to) {
  convert_joints(from->start, dof, &to->start);
  convert_joints(from->end, dof, &to->end);
  const CORBA_unsigned_long length = (CORBA_unsigned_long)from->part_count;
  to->parts._buffer = Corbot_PlanParts_allocbuf(length);
  to->parts._length = to->parts._maximum = length;
  to->parts._release = CORBA_TRUE;
  for (CORBA_unsigned_long k = 0; k < length; ++k) {
    const corbot_plan_part* part = &from->parts[k];
    Corbot_PlanPart* into = &to->parts._buffer[k];
    into->duration = part->duration_s;
    convert_stretches(part, &into->stretches);
    into->hasPivot = part->has_pivot ? CORBA_TRUE : CORBA_FALSE;
    into->leastPivot = part->least_pivot;
    into->pivotPoint.x = part->pivot_point_m[0];
    into->pivotPoint.y = part->pivot_point_m[1];
    into->pivotPoint.z = part->pivot_point_m[2];
  }
}

void convert_arm_state(const corbot_arm_state* from, int32_t dof, Corbot_ArmState* to) {
  to->cycle = from->cycle;
  to->time = from->time_s;
  to->age = from->age_s;
  to->status = convert_state(from->status);
  to->paused = from->paused ? CORBA_TRUE : CORBA_FALSE;
  to->overridePercent = from->override_percent;
  convert_joints(from->commanded, dof, &to->commanded);
  convert_joints(from->speed, dof, &to->speeds);
  to->measured = from->measured ? CORBA_TRUE : CORBA_FALSE;
  convert_joints(from->measured_joints, from->measured ? dof : 0, &to->measuredJoints);
  to->tool = convert_pose(&from->tool);
  to->toolCommanded = convert_pose(&from->tool_commanded);
  convert_motion(&from->motion, &to->motion);
  to->queued = from->queued;
  to->gripper = convert_gripper(&from->gripper);
  convert_device(&from->device, &to->device);
  to->control.holder = CORBA_string_dup(from->holder.who);
  to->control.left = from->holder.left_s;
  to->control.held = from->held ? CORBA_TRUE : CORBA_FALSE;
}
