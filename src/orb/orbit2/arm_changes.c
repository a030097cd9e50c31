/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_changes.h"

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/raise.h"

static void check(corbot_status status, const corbot_error* error, CORBA_Environment* ev) {
  if (status != CORBOT_OK) raise_failure(error, ev);
}

/* Raises the failure of an operation that does not raise NotReady. */
static void check_setting(corbot_status status, const corbot_error* error, const Caller* caller,
                          CORBA_Environment* ev) {
  if (status != CORBOT_OK) raise_failure_of_setting(error, caller->call.key, ev);
}

static void speed(PortableServer_Servant servant, CORBA_double percent, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check_setting(corbot_robot_speed(self_of(servant)->robot, caller_of(servant, &room), percent, &error),
                &error, &room, ev);
}

static void art_speed(PortableServer_Servant servant, CORBA_long articulation, CORBA_double percent,
                      CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check_setting(corbot_robot_art_speed(self_of(servant)->robot, caller_of(servant, &room), articulation,
                                       percent, &error),
                &error, &room, ev);
}

static void all_speed(PortableServer_Servant servant, CORBA_double percent, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check_setting(corbot_robot_all_speed(self_of(servant)->robot, caller_of(servant, &room), percent, &error),
                &error, &room, ev);
}

static void set_tool_pitch(PortableServer_Servant servant, CORBA_double degrees, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check_setting(
      corbot_robot_set_tool_pitch(self_of(servant)->robot, caller_of(servant, &room), degrees, &error),
      &error, &room, ev);
}

static void set_tool_orientation(PortableServer_Servant servant, const Corbot_Quaternion* orientation,
                                 CORBA_Environment* ev) {
  const double wxyz[4] = {orientation->w, orientation->x, orientation->y, orientation->z};
  Caller room;
  corbot_error error;
  check_setting(
      corbot_robot_set_tool_orientation(self_of(servant)->robot, caller_of(servant, &room), wxyz, &error),
      &error, &room, ev);
}

static void reset_tool_orientation(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check_setting(
      corbot_robot_reset_tool_orientation(self_of(servant)->robot, caller_of(servant, &room), &error), &error,
      &room, ev);
}

static void stop(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_stop(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static void stop_and_hold(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_stop_and_hold(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static void cancel(PortableServer_Servant servant, Corbot_Ticket id, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_cancel(self_of(servant)->robot, caller_of(servant, &room), id, &error), &error, ev);
}

static void pause_motion(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_pause(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static void resume(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_resume(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static void set_override(PortableServer_Servant servant, CORBA_double percent, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_set_override(self_of(servant)->robot, caller_of(servant, &room), percent, &error),
        &error, ev);
}

/* ORBit2 does not check the bound of sequence<JointRange, 6>. A truncated request gives NULL. */
static void set_soft_limits(PortableServer_Servant servant, const Corbot_JointRanges* limits,
                            CORBA_Environment* ev) {
  const CORBA_unsigned_long count = limits == NULL ? 0 : limits->_length;
  if (limits == NULL || count > CORBOT_MAX_JOINTS || (count > 0 && limits->_buffer == NULL)) {
    CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
    return;
  }
  corbot_joint_ranges wanted = {{0}, {0}};
  for (CORBA_unsigned_long i = 0; i < count; ++i) {
    wanted.lower[i] = limits->_buffer[i].lower;
    wanted.upper[i] = limits->_buffer[i].upper;
  }
  Caller room;
  corbot_error error;
  check(corbot_robot_set_soft_limits(self_of(servant)->robot, caller_of(servant, &room), &wanted, count,
                                     &error),
        &error, ev);
}

static void reset_soft_limits(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_reset_soft_limits(self_of(servant)->robot, caller_of(servant, &room), &error), &error,
        ev);
}

static void clear(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_clear(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static Corbot_Arm acquire(PortableServer_Servant servant, const CORBA_char* who, CORBA_double lease,
                          CORBA_Environment* ev) {
  if (who == NULL) { /* a truncated request */
    CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
    return CORBA_OBJECT_NIL;
  }
  Caller room;
  corbot_error error;
  char key[CORBOT_KEY];
  const corbot_status status =
      corbot_robot_acquire(self_of(servant)->robot, caller_of(servant, &room), who, lease, key, &error);
  if (status == CORBOT_OK) return control_reference(self_of(servant)->references, key, ev);
  raise_failure(&error, ev);
  return CORBA_OBJECT_NIL;
}

static void renew(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_renew(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

static void release(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  check(corbot_robot_release(self_of(servant)->robot, caller_of(servant, &room), &error), &error, ev);
}

void arm_set_changes(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm) {
  robot->Speed = speed;
  robot->ArtSpeed = art_speed;
  robot->AllSpeed = all_speed;
  arm->Stop = stop;
  arm->StopAndHold = stop_and_hold;
  arm->Cancel = cancel;
  arm->Pause = pause_motion;
  arm->Resume = resume;
  arm->Override = set_override;
  arm->Clear = clear;
  arm->SetToolPitch = set_tool_pitch;
  arm->SetToolOrientation = set_tool_orientation;
  arm->ResetToolOrientation = reset_tool_orientation;
  arm->SetSoftLimits = set_soft_limits;
  arm->ResetSoftLimits = reset_soft_limits;
  arm->Acquire = acquire;
  arm->Renew = renew;
  arm->Release = release;
}
