/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_reads.h"

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/convert.h"
#include "orb/orbit2/raise.h"

static Corbot_JointCoord* get_arti_coord(PortableServer_Servant servant, CORBA_Environment* ev) {
  double joints[CORBOT_MAX_JOINTS];
  corbot_error error;
  if (corbot_robot_joints(self_of(servant)->robot, joints, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  Corbot_JointCoord* result = Corbot_JointCoord__alloc();
  convert_joints(joints, self_of(servant)->description.dof, result);
  return result;
}

static Corbot_CartesianCoord get_cart_coord(PortableServer_Servant servant, CORBA_Environment* ev) {
  corbot_pose pose = {0};
  corbot_error error;
  if (corbot_robot_pose(self_of(servant)->robot, &pose, &error) != CORBOT_OK) raise_failure(&error, ev);
  const Corbot_CartesianCoord result = {pose.x_m, pose.y_m, pose.z_m, pose.a_deg, pose.b_deg, pose.c_deg};
  return result;
}

static Corbot_GripperState get_gripper_status(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return corbot_robot_gripper(self_of(servant)->robot) == CORBOT_GRIPPER_OPEN ? Corbot_Open : Corbot_Close;
}

static Corbot_RobotState get_status(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return convert_state(corbot_robot_state(self_of(servant)->robot));
}

static Corbot_RobotKind get_robot_type(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return (Corbot_RobotKind)self_of(servant)->description.kind;
}

static CORBA_long get_dof(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return self_of(servant)->description.dof;
}

static Corbot_JointRanges* ranges_of(const double* lower, const double* upper, CORBA_unsigned_long count) {
  Corbot_JointRanges* result = Corbot_JointRanges__alloc();
  result->_buffer = Corbot_JointRanges_allocbuf(count);
  result->_length = result->_maximum = count;
  result->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < count; ++i) {
    result->_buffer[i].lower = lower[i];
    result->_buffer[i].upper = upper[i];
  }
  return result;
}

static Corbot_JointRanges* get_mov_range(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  const corbot_description* description = &self_of(servant)->description;
  return ranges_of(description->lower, description->upper, (CORBA_unsigned_long)description->dof);
}

static Corbot_JointRanges* get_soft_limits(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_joint_ranges limits;
  const int32_t known = corbot_robot_soft_limits(self_of(servant)->robot, &limits);
  const int32_t dof = self_of(servant)->description.dof;
  return ranges_of(limits.lower, limits.upper, (CORBA_unsigned_long)(known ? dof : 0));
}

static Corbot_JointList* get_joints(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  const corbot_description* description = &self_of(servant)->description;
  const CORBA_unsigned_long count = (CORBA_unsigned_long)description->dof;
  Corbot_JointList* result = Corbot_JointList__alloc();
  result->_buffer = Corbot_JointList_allocbuf(count);
  result->_length = result->_maximum = count;
  result->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < count; ++i) {
    result->_buffer[i].name = CORBA_string_dup(description->joint_name[i]);
    result->_buffer[i].kind = description->slides[i] ? Corbot_JointSlides : Corbot_JointTurns;
    result->_buffer[i].range.lower = description->lower[i];
    result->_buffer[i].range.upper = description->upper[i];
    result->_buffer[i].speed = description->speed[i];
  }
  return result;
}

static CORBA_string get_description(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return CORBA_string_dup(corbot_robot_urdf(self_of(servant)->robot));
}

static CORBA_double get_reach(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return self_of(servant)->description.reach_m;
}

static CORBA_double get_override_percent(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return corbot_robot_override(self_of(servant)->robot);
}

static CORBA_double get_tool_pitch(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return corbot_robot_tool_pitch(self_of(servant)->robot);
}

static Corbot_SpeedSettings* get_speeds(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  const CORBA_unsigned_long dof = (CORBA_unsigned_long)self_of(servant)->description.dof;
  double joints[CORBOT_MAX_JOINTS];
  Corbot_SpeedSettings* result = Corbot_SpeedSettings__alloc();
  corbot_robot_speeds(self_of(servant)->robot, &result->tool, joints);
  result->joints._buffer = Corbot_JointPercents_allocbuf(dof);
  result->joints._length = result->joints._maximum = dof;
  result->joints._release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < dof; ++i) result->joints._buffer[i] = joints[i];
  return result;
}

static Corbot_ToolOrientationInfo get_tool_orientation(PortableServer_Servant servant,
                                                       CORBA_Environment* ev) {
  (void)ev;
  double q[4];
  const int32_t is_set = corbot_robot_tool_orientation(self_of(servant)->robot, q);
  const Corbot_ToolOrientationInfo result = {is_set ? CORBA_TRUE : CORBA_FALSE, {q[0], q[1], q[2], q[3]}};
  return result;
}

static Corbot_AlarmList* get_alarms(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_alarm alarms[CORBOT_MAX_ALARMS];
  const CORBA_unsigned_long count = (CORBA_unsigned_long)corbot_robot_alarms(self_of(servant)->robot, alarms);
  Corbot_AlarmList* result = Corbot_AlarmList__alloc();
  result->_buffer = Corbot_AlarmList_allocbuf(count);
  result->_length = result->_maximum = count;
  result->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < count; ++i) {
    result->_buffer[i].time = alarms[i].time_s;
    result->_buffer[i].code = alarms[i].code;
    result->_buffer[i].active = alarms[i].active ? CORBA_TRUE : CORBA_FALSE;
    result->_buffer[i].text = CORBA_string_dup(alarms[i].text);
  }
  return result;
}

static Corbot_LoopInfo* get_diagnostics(PortableServer_Servant servant, CORBA_Environment* ev) {
  corbot_loop_info loop;
  corbot_error error;
  if (corbot_robot_loop_info(self_of(servant)->robot, &loop, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  Corbot_LoopInfo* result = Corbot_LoopInfo__alloc();
  result->period = loop.period_s;
  result->since = loop.since_s;
  result->cycles = loop.cycles;
  result->overruns = loop.overruns;
  result->latencyMean = loop.latency_mean_s;
  result->latencyMax = loop.latency_max_s;
  result->workMax = loop.work_max_s;
  result->realTime = loop.realtime ? CORBA_TRUE : CORBA_FALSE;
  result->counts._buffer = Corbot_LatencyCounts_allocbuf(CORBOT_LATENCY_BUCKETS);
  result->counts._length = result->counts._maximum = CORBOT_LATENCY_BUCKETS;
  result->counts._release = CORBA_TRUE;
  result->edges._buffer = Corbot_LatencyEdges_allocbuf(CORBOT_LATENCY_BUCKETS);
  result->edges._length = result->edges._maximum = CORBOT_LATENCY_BUCKETS;
  result->edges._release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < CORBOT_LATENCY_BUCKETS; ++i) {
    result->counts._buffer[i] = loop.counts[i];
    result->edges._buffer[i] = loop.edges_s[i];
  }
  return result;
}

static Corbot_DeviceInfo* get_device(PortableServer_Servant servant, CORBA_Environment* ev) {
  corbot_device_info device;
  corbot_error error;
  if (corbot_robot_device_info(self_of(servant)->robot, &device, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  Corbot_DeviceInfo* result = Corbot_DeviceInfo__alloc();
  convert_device(&device, result);
  return result;
}

static Corbot_ArmState* get_state(PortableServer_Servant servant, CORBA_Environment* ev) {
  corbot_arm_state state;
  corbot_error error;
  if (corbot_robot_arm_state(self_of(servant)->robot, &state, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  Corbot_ArmState* result = Corbot_ArmState__alloc();
  convert_arm_state(&state, self_of(servant)->description.dof, result);
  return result;
}

static Corbot_GripperInfo get_gripper(PortableServer_Servant servant, CORBA_Environment* ev) {
  corbot_arm_state state = {0};
  corbot_error error;
  if (corbot_robot_arm_state(self_of(servant)->robot, &state, &error) != CORBOT_OK) raise_failure(&error, ev);
  return convert_gripper(&state.gripper);
}

static Corbot_ServantInfo* get_servant(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  const corbot_description* description = &self_of(servant)->description;
  Corbot_ServantInfo* result = Corbot_ServantInfo__alloc();
  result->version = CORBA_string_dup(description->version);
  result->profile = CORBA_string_dup(description->fingerprint);
  result->started = description->started_s;
  return result;
}

static CORBA_double get_cycle_age(PortableServer_Servant servant, CORBA_Environment* ev) {
  double age_s = 0;
  corbot_error error;
  if (corbot_robot_cycle_age(self_of(servant)->robot, &age_s, &error) != CORBOT_OK) raise_failure(&error, ev);
  return age_s;
}

static CORBA_boolean get_paused(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  return corbot_robot_paused(self_of(servant)->robot) ? CORBA_TRUE : CORBA_FALSE;
}

static Corbot_ControlInfo* get_control(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_holder holder;
  corbot_robot_holder(self_of(servant)->robot, &holder);
  Corbot_ControlInfo* result = Corbot_ControlInfo__alloc();
  result->holder = CORBA_string_dup(holder.who);
  result->left = holder.left_s;
  result->held = corbot_robot_held(self_of(servant)->robot) ? CORBA_TRUE : CORBA_FALSE;
  return result;
}

void arm_set_reads(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm) {
  robot->_get_ArtiCoord = get_arti_coord;
  robot->_get_CartCoord = get_cart_coord;
  robot->_get_GripperStatus = get_gripper_status;
  robot->_get_Status = get_status;
  robot->_get_RobotType = get_robot_type;
  robot->_get_DoF = get_dof;
  robot->_get_MovRange = get_mov_range;
  robot->_get_Reach = get_reach;
  arm->_get_Paused = get_paused;
  arm->_get_OverridePercent = get_override_percent;
  arm->_get_ToolPitch = get_tool_pitch;
  arm->_get_Speeds = get_speeds;
  arm->_get_ToolOrientation = get_tool_orientation;
  arm->_get_SoftLimits = get_soft_limits;
  arm->_get_Joints = get_joints;
  arm->_get_Description = get_description;
  arm->_get_State = get_state;
  arm->_get_Gripper = get_gripper;
  arm->_get_Alarms = get_alarms;
  arm->_get_Diagnostics = get_diagnostics;
  arm->_get_Device = get_device;
  arm->_get_Servant = get_servant;
  arm->_get_CycleAge = get_cycle_age;
  arm->_get_Control = get_control;
}
