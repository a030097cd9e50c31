/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_plans.h"

#include <stdbool.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/convert.h"
#include "orb/orbit2/raise.h"

/* Arguments with which a function of corbot_robot.h that starts a motion only plans it. */
typedef struct Planning {
  corbot_robot* robot;
  Caller room;
  corbot_caller caller;
  corbot_plan plan;
  corbot_ticket ticket; /* of no motion */
  corbot_error error;
} Planning;

static void begin(PortableServer_Servant servant, Planning* planning) {
  planning->robot = self_of(servant)->robot;
  planning->caller = *caller_of(servant, &planning->room);
  planning->caller.plan = &planning->plan;
}

static Corbot_PlanInfo* found(PortableServer_Servant servant, corbot_status status, const Planning* planning,
                              CORBA_Environment* ev) {
  if (status != CORBOT_OK) {
    raise_failure(&planning->error, ev);
    return NULL;
  }
  Corbot_PlanInfo* result = Corbot_PlanInfo__alloc();
  convert_plan(&planning->plan, self_of(servant)->description.dof, result);
  return result;
}

/* Returns false for a truncated request, which gives NULL. */
static bool is_there(const void* argument, CORBA_Environment* ev) {
  if (argument == NULL) CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
  return argument != NULL;
}

static Corbot_PlanInfo* plan_move(PortableServer_Servant servant, CORBA_double px, CORBA_double py,
                                  CORBA_double pz, CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  const double p_m[3] = {px, py, pz};
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_move(to.robot, &to.caller, p_m, d, t, &to.ticket, &to.error), &to, ev);
}

static Corbot_PlanInfo* plan_move_s(PortableServer_Servant servant, CORBA_double px, CORBA_double py,
                                    CORBA_double pz, CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  const double p_m[3] = {px, py, pz};
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_move_s(to.robot, &to.caller, p_m, d, t, &to.ticket, &to.error), &to, ev);
}

static Corbot_PlanInfo* plan_move_c(PortableServer_Servant servant, const Corbot_Point* p1,
                                    const Corbot_Point* p2, const Corbot_Point* p3, CORBA_Environment* ev) {
  if (!is_there(p1, ev) || !is_there(p2, ev) || !is_there(p3, ev)) return NULL;
  const double p1_m[3] = {p1->x, p1->y, p1->z};
  const double p2_m[3] = {p2->x, p2->y, p2->z};
  const double p3_m[3] = {p3->x, p3->y, p3->z};
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_move_c(to.robot, &to.caller, p1_m, p2_m, p3_m, &to.ticket, &to.error),
               &to, ev);
}

static Corbot_PlanInfo* plan_drive(PortableServer_Servant servant, CORBA_long articulation,
                                   CORBA_double increment, CORBA_double speed, CORBA_Environment* ev) {
  Planning to;
  begin(servant, &to);
  return found(
      servant,
      corbot_robot_drive(to.robot, &to.caller, articulation, increment, speed, &to.ticket, &to.error), &to,
      ev);
}

static Corbot_PlanInfo* plan_move_joints(PortableServer_Servant servant, const Corbot_JointCoord* target,
                                         CORBA_double t, CORBA_Environment* ev) {
  if (!is_there(target, ev)) return NULL;
  /* ORBit2 does not check the bound of a sequence. */
  const CORBA_unsigned_long count = target->_length;
  if (count > CORBOT_MAX_JOINTS || (count > 0 && target->_buffer == NULL)) {
    CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
    return NULL;
  }
  const double none = 0.0;
  const double* values = count > 0 ? target->_buffer : &none;
  Planning to;
  begin(servant, &to);
  return found(servant,
               corbot_robot_move_joints(to.robot, &to.caller, values, count, t, &to.ticket, &to.error), &to,
               ev);
}

static Corbot_PlanInfo* plan_ready(PortableServer_Servant servant, CORBA_Environment* ev) {
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_ready(to.robot, &to.caller, &to.ticket, &to.error), &to, ev);
}

static Corbot_PlanInfo* plan_move_pose(PortableServer_Servant servant, const Corbot_Pose* target,
                                       CORBA_double t, CORBA_Environment* ev) {
  if (!is_there(target, ev)) return NULL;
  const corbot_tool_pose pose = convert_to_pose(target);
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_move_pose(to.robot, &to.caller, &pose, t, &to.ticket, &to.error), &to,
               ev);
}

static Corbot_PlanInfo* plan_move_pose_s(PortableServer_Servant servant, const Corbot_Pose* target,
                                         CORBA_double t, CORBA_Environment* ev) {
  if (!is_there(target, ev)) return NULL;
  const corbot_tool_pose pose = convert_to_pose(target);
  Planning to;
  begin(servant, &to);
  return found(servant, corbot_robot_move_pose_s(to.robot, &to.caller, &pose, t, &to.ticket, &to.error), &to,
               ev);
}

static Corbot_PlanInfo* plan_move_relative(PortableServer_Servant servant, const Corbot_Pose* offset,
                                           const Corbot_OffsetFrame frame, CORBA_double t,
                                           CORBA_Environment* ev) {
  if (!is_there(offset, ev)) return NULL;
  const corbot_tool_pose pose = convert_to_pose(offset);
  Planning to;
  begin(servant, &to);
  return found(
      servant,
      corbot_robot_move_relative(to.robot, &to.caller, &pose, (int32_t)frame, t, &to.ticket, &to.error), &to,
      ev);
}

static Corbot_PlanInfo* plan_move_relative_s(PortableServer_Servant servant, const Corbot_Pose* offset,
                                             const Corbot_OffsetFrame frame, CORBA_double t,
                                             CORBA_Environment* ev) {
  if (!is_there(offset, ev)) return NULL;
  const corbot_tool_pose pose = convert_to_pose(offset);
  Planning to;
  begin(servant, &to);
  return found(
      servant,
      corbot_robot_move_relative_s(to.robot, &to.caller, &pose, (int32_t)frame, t, &to.ticket, &to.error),
      &to, ev);
}

void arm_set_plans(POA_Corbot_Arm__epv* arm) {
  arm->PlanMove = plan_move;
  arm->PlanMoveS = plan_move_s;
  arm->PlanMoveC = plan_move_c;
  arm->PlanDrive = plan_drive;
  arm->PlanMoveJoints = plan_move_joints;
  arm->PlanReady = plan_ready;
  arm->PlanMovePose = plan_move_pose;
  arm->PlanMovePoseS = plan_move_pose_s;
  arm->PlanMoveRelative = plan_move_relative;
  arm->PlanMoveRelativeS = plan_move_relative_s;
}
