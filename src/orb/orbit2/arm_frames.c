/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_frames.h"

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/convert.h"
#include "orb/orbit2/raise.h"

typedef corbot_status (*SetFrame)(corbot_robot* robot, const corbot_caller* caller,
                                  const corbot_tool_pose* frame, corbot_error* error);

/* Returns false for a truncated request, which gives NULL. */
static bool is_whole(const Corbot_Pose* pose, CORBA_Environment* ev) {
  if (pose == NULL) CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
  return pose != NULL;
}

static void set_frame(SetFrame set, PortableServer_Servant servant, const Corbot_Pose* frame,
                      CORBA_Environment* ev) {
  if (!is_whole(frame, ev)) return;
  const corbot_tool_pose wanted = convert_to_pose(frame);
  Caller room;
  corbot_error error;
  if (set(self_of(servant)->robot, caller_of(servant, &room), &wanted, &error) != CORBOT_OK)
    raise_failure(&error, ev);
}

static void set_tool_frame(PortableServer_Servant servant, const Corbot_Pose* flange_T_tool,
                           CORBA_Environment* ev) {
  set_frame(corbot_robot_set_tool_frame, servant, flange_T_tool, ev);
}

static void set_base_frame(PortableServer_Servant servant, const Corbot_Pose* world_T_base,
                           CORBA_Environment* ev) {
  set_frame(corbot_robot_set_base_frame, servant, world_T_base, ev);
}

static void reset_frames(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  if (corbot_robot_reset_frames(self_of(servant)->robot, caller_of(servant, &room), &error) != CORBOT_OK)
    raise_failure(&error, ev);
}

static Corbot_Pose get_tool_frame(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_tool_pose tool = {{0}, {0}}, base = {{0}, {0}};
  corbot_robot_frames(self_of(servant)->robot, &tool, &base);
  return convert_pose(&tool);
}

static Corbot_Pose get_base_frame(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_tool_pose tool = {{0}, {0}}, base = {{0}, {0}};
  corbot_robot_frames(self_of(servant)->robot, &tool, &base);
  return convert_pose(&base);
}

static Corbot_PoseSolutions* solutions(PortableServer_Servant servant, const Corbot_Pose* target,
                                       CORBA_Environment* ev) {
  if (!is_whole(target, ev)) return NULL;
  const corbot_tool_pose wanted = convert_to_pose(target);
  corbot_pose_solution found[CORBOT_MAX_SOLUTIONS];
  size_t count = 0;
  corbot_error error;
  if (corbot_robot_solutions(self_of(servant)->robot, &wanted, found, &count, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  const CORBA_unsigned_long length = (CORBA_unsigned_long)count;
  Corbot_PoseSolutions* result = Corbot_PoseSolutions__alloc();
  result->_buffer = Corbot_PoseSolutions_allocbuf(length);
  result->_length = result->_maximum = length;
  result->_release = CORBA_TRUE;
  for (CORBA_unsigned_long i = 0; i < length; ++i) {
    Corbot_PoseSolution* to = &result->_buffer[i];
    to->number = found[i].number;
    convert_joints(found[i].joints, self_of(servant)->description.dof, &to->joints);
    to->withinLimits = found[i].in_range ? CORBA_TRUE : CORBA_FALSE;
    to->orientationError = found[i].orientation_error_deg;
  }
  return result;
}

static CORBA_long get_solution(PortableServer_Servant servant, CORBA_Environment* ev) {
  int32_t number = -1;
  corbot_error error;
  if (corbot_robot_solution(self_of(servant)->robot, &number, &error) != CORBOT_OK) raise_failure(&error, ev);
  return number;
}

void arm_set_frames(POA_Corbot_Arm__epv* arm) {
  arm->SetToolFrame = set_tool_frame;
  arm->SetBaseFrame = set_base_frame;
  arm->ResetFrames = reset_frames;
  arm->_get_ToolFrame = get_tool_frame;
  arm->_get_BaseFrame = get_base_frame;
  arm->Solutions = solutions;
  arm->_get_Solution = get_solution;
}
