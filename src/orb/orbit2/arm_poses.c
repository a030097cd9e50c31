/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_poses.h"

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/convert.h"
#include "orb/orbit2/motion_calls.h"

typedef corbot_status (*StartPose)(corbot_robot*, const corbot_caller*, const corbot_tool_pose*, double,
                                   corbot_ticket*, corbot_error*);
typedef corbot_status (*StartRelative)(corbot_robot*, const corbot_caller*, const corbot_tool_pose*, int32_t,
                                       double, corbot_ticket*, corbot_error*);

static Corbot_Ticket start_pose_with(StartPose start, PortableServer_Servant servant,
                                     const Corbot_Pose* target, double t, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  const corbot_tool_pose pose = convert_to_pose(target);
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant, start(self_of(servant)->robot, caller, &pose, t, &ticket, &error), &ticket,
                        &error, ev);
}

/* Starts a relative motion. ORBit2 does not check that `frame` is a member of its enumeration; the robot
 * does. */
static Corbot_Ticket start_relative_with(StartRelative start, PortableServer_Servant servant,
                                         const Corbot_Pose* offset, Corbot_OffsetFrame frame, double t,
                                         CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  const corbot_tool_pose pose = convert_to_pose(offset);
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant,
                        start(self_of(servant)->robot, caller, &pose, (int32_t)frame, t, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_move_pose(PortableServer_Servant servant, const Corbot_Pose* target,
                                     CORBA_double t, CORBA_Environment* ev) {
  return start_pose_with(corbot_robot_move_pose, servant, target, t, ev);
}

static Corbot_Ticket start_move_pose_s(PortableServer_Servant servant, const Corbot_Pose* target,
                                       CORBA_double t, CORBA_Environment* ev) {
  return start_pose_with(corbot_robot_move_pose_s, servant, target, t, ev);
}

static Corbot_Ticket start_move_relative(PortableServer_Servant servant, const Corbot_Pose* offset,
                                         const Corbot_OffsetFrame frame, CORBA_double t,
                                         CORBA_Environment* ev) {
  return start_relative_with(corbot_robot_move_relative, servant, offset, frame, t, ev);
}

static Corbot_Ticket start_move_relative_s(PortableServer_Servant servant, const Corbot_Pose* offset,
                                           const Corbot_OffsetFrame frame, CORBA_double t,
                                           CORBA_Environment* ev) {
  return start_relative_with(corbot_robot_move_relative_s, servant, offset, frame, t, ev);
}

static void move_pose(PortableServer_Servant servant, const Corbot_Pose* target, CORBA_double t,
                      CORBA_Environment* ev) {
  motion_finish(servant, start_move_pose(servant, target, t, ev), ev);
}

static void move_pose_s(PortableServer_Servant servant, const Corbot_Pose* target, CORBA_double t,
                        CORBA_Environment* ev) {
  motion_finish(servant, start_move_pose_s(servant, target, t, ev), ev);
}

static void move_relative(PortableServer_Servant servant, const Corbot_Pose* offset,
                          const Corbot_OffsetFrame frame, CORBA_double t, CORBA_Environment* ev) {
  motion_finish(servant, start_move_relative(servant, offset, frame, t, ev), ev);
}

static void move_relative_s(PortableServer_Servant servant, const Corbot_Pose* offset,
                            const Corbot_OffsetFrame frame, CORBA_double t, CORBA_Environment* ev) {
  motion_finish(servant, start_move_relative_s(servant, offset, frame, t, ev), ev);
}

void arm_set_poses(POA_Corbot_Arm__epv* arm) {
  arm->MovePose = move_pose;
  arm->MovePoseS = move_pose_s;
  arm->StartMovePose = start_move_pose;
  arm->StartMovePoseS = start_move_pose_s;
  arm->MoveRelative = move_relative;
  arm->MoveRelativeS = move_relative_s;
  arm->StartMoveRelative = start_move_relative;
  arm->StartMoveRelativeS = start_move_relative_s;
}
