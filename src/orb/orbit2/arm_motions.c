/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_motions.h"

#include <math.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/convert.h"
#include "orb/orbit2/motion_calls.h"
#include "orb/orbit2/raise.h"
#include "orb/orbit2/requests.h"

/* Bound of the IDL's sequence<double, 6>, which ORBit2 does not check. */
enum { kLongestJointCoord = 6 };

static Corbot_Ticket start_move(PortableServer_Servant servant, CORBA_double px, CORBA_double py,
                                CORBA_double pz, CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  const double p_m[3] = {px, py, pz};
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant,
                        corbot_robot_move(self_of(servant)->robot, caller, p_m, d, t, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_move_s(PortableServer_Servant servant, CORBA_double px, CORBA_double py,
                                  CORBA_double pz, CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  const double p_m[3] = {px, py, pz};
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant,
                        corbot_robot_move_s(self_of(servant)->robot, caller, p_m, d, t, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_move_c(PortableServer_Servant servant, const Corbot_Point* p1,
                                  const Corbot_Point* p2, const Corbot_Point* p3, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  const double p1_m[3] = {p1->x, p1->y, p1->z};
  const double p2_m[3] = {p2->x, p2->y, p2->z};
  const double p3_m[3] = {p3->x, p3->y, p3->z};
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(
      servant, corbot_robot_move_c(self_of(servant)->robot, caller, p1_m, p2_m, p3_m, &ticket, &error),
      &ticket, &error, ev);
}

static Corbot_Ticket start_drive(PortableServer_Servant servant, CORBA_long articulation,
                                 CORBA_double increment, CORBA_double speed, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(
      servant,
      corbot_robot_drive(self_of(servant)->robot, caller, articulation, increment, speed, &ticket, &error),
      &ticket, &error, ev);
}

static Corbot_Ticket start_move_joints(PortableServer_Servant servant, const Corbot_JointCoord* target,
                                       CORBA_double t, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  /* A truncated request gives a NULL sequence, or one whose buffer is NULL. */
  const CORBA_unsigned_long count = target == NULL ? 0 : target->_length;
  if (count > kLongestJointCoord || (count > 0 && target->_buffer == NULL)) {
    CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
    return 0;
  }
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  const double none = 0.0;
  return motion_started(
      servant,
      corbot_robot_move_joints(self_of(servant)->robot, caller, count > 0 ? target->_buffer : &none, count, t,
                               &ticket, &error),
      &ticket, &error, ev);
}

static Corbot_Ticket start_ready(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant, corbot_robot_ready(self_of(servant)->robot, caller, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_delay(PortableServer_Servant servant, CORBA_double t, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant, corbot_robot_delay(self_of(servant)->robot, caller, t, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_open(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant, corbot_robot_open_gripper(self_of(servant)->robot, caller, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_close(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant, corbot_robot_close_gripper(self_of(servant)->robot, caller, &ticket, &error),
                        &ticket, &error, ev);
}

static Corbot_Ticket start_set_gripper(PortableServer_Servant servant, CORBA_double percent,
                                       CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return 0;
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  corbot_ticket ticket = 0;
  corbot_error error;
  return motion_started(servant,
                        corbot_robot_set_gripper(self_of(servant)->robot, caller, percent, &ticket, &error),
                        &ticket, &error, ev);
}

static void move(PortableServer_Servant servant, CORBA_double px, CORBA_double py, CORBA_double pz,
                 CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  motion_finish(servant, start_move(servant, px, py, pz, d, t, ev), ev);
}

static void move_s(PortableServer_Servant servant, CORBA_double px, CORBA_double py, CORBA_double pz,
                   CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  motion_finish(servant, start_move_s(servant, px, py, pz, d, t, ev), ev);
}

static void move_c(PortableServer_Servant servant, const Corbot_Point* p1, const Corbot_Point* p2,
                   const Corbot_Point* p3, CORBA_Environment* ev) {
  motion_finish(servant, start_move_c(servant, p1, p2, p3, ev), ev);
}

static void drive(PortableServer_Servant servant, CORBA_long articulation, CORBA_double increment,
                  CORBA_double speed, CORBA_Environment* ev) {
  motion_finish(servant, start_drive(servant, articulation, increment, speed, ev), ev);
}

static void move_joints(PortableServer_Servant servant, const Corbot_JointCoord* target, CORBA_double t,
                        CORBA_Environment* ev) {
  motion_finish(servant, start_move_joints(servant, target, t, ev), ev);
}

static void ready(PortableServer_Servant servant, CORBA_Environment* ev) {
  motion_finish(servant, start_ready(servant, ev), ev);
}

static void delay(PortableServer_Servant servant, CORBA_double t, CORBA_Environment* ev) {
  motion_finish(servant, start_delay(servant, t, ev), ev);
}

static void open_gripper(PortableServer_Servant servant, CORBA_Environment* ev) {
  motion_finish(servant, start_open(servant, ev), ev);
}

static void close_gripper(PortableServer_Servant servant, CORBA_Environment* ev) {
  motion_finish(servant, start_close(servant, ev), ev);
}

static void set_gripper(PortableServer_Servant servant, CORBA_double percent, CORBA_Environment* ev) {
  motion_finish(servant, start_set_gripper(servant, percent, ev), ev);
}

static Corbot_MotionInfo* info_of(PortableServer_Servant servant, Corbot_Ticket id, double timeout_s,
                                  const corbot_caller* caller, CORBA_Environment* ev) {
  corbot_motion_info info;
  corbot_error error;
  if (corbot_robot_wait(self_of(servant)->robot, id, timeout_s, caller, &info, &error) != CORBOT_OK) {
    raise_failure(&error, ev);
    return NULL;
  }
  Corbot_MotionInfo* result = Corbot_MotionInfo__alloc();
  convert_motion(&info, result);
  return result;
}

static Corbot_MotionInfo* wait_for(PortableServer_Servant servant, Corbot_Ticket id, CORBA_double timeout,
                                   CORBA_Environment* ev) {
  if (!motion_has_place(servant, ev)) return NULL;
  if (isnan(timeout) || timeout < 0.0) {
    raise_bad_parameter("timeout", timeout, "the time-out must not be negative", ev);
    return NULL;
  }
  Caller room;
  const corbot_caller* caller = caller_of(servant, &room);
  Corbot_MotionInfo* result = info_of(servant, id, timeout, caller, ev);
  requests_leave(self_of(servant)->target);
  return result;
}

static Corbot_MotionInfo* progress(PortableServer_Servant servant, Corbot_Ticket id, CORBA_Environment* ev) {
  return info_of(servant, id, 0.0, NULL, ev);
}

void arm_set_motions(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm) {
  robot->Move = move;
  robot->MoveS = move_s;
  robot->MoveC = move_c;
  robot->Drive = drive;
  robot->Ready = ready;
  robot->Delay = delay;
  robot->Open = open_gripper;
  robot->Close = close_gripper;
  arm->StartMove = start_move;
  arm->StartMoveS = start_move_s;
  arm->StartMoveC = start_move_c;
  arm->StartDrive = start_drive;
  arm->StartMoveJoints = start_move_joints;
  arm->StartReady = start_ready;
  arm->StartDelay = start_delay;
  arm->StartOpen = start_open;
  arm->StartClose = start_close;
  arm->StartSetGripper = start_set_gripper;
  arm->SetGripper = set_gripper;
  arm->MoveJoints = move_joints;
  arm->Wait = wait_for;
  arm->Progress = progress;
}
