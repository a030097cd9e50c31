/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_bounded.h"

#include <string.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/raise.h"
#include "orb/orbit2/requests.h"

static POA_Corbot_Arm__epv inner;

static bool is_refused(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (self_of(servant)->target < CORBOT_PLACES) return false;
  corbot_error error = {.status = CORBOT_NOT_READY, .joint = -1};
  strncpy(error.text, kChangesRefused, sizeof(error.text) - 1);
  raise_failure(&error, ev);
  return true;
}

/* Returns true if the stop was requested on arrival; then waits for it. */
static bool is_joined(PortableServer_Servant servant, int32_t hold, CORBA_Environment* ev) {
  if (self_of(servant)->target != kTargetJoinStop) return false;
  corbot_error error;
  if (corbot_robot_await_stops(self_of(servant)->robot, hold, &error) != CORBOT_OK) raise_failure(&error, ev);
  return true;
}

static void stop(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_joined(servant, 0, ev)) return;
  inner.Stop(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void stop_and_hold(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_joined(servant, 1, ev)) return;
  inner.StopAndHold(servant, ev);
  requests_leave(self_of(servant)->target);
}

static Corbot_Arm acquire(PortableServer_Servant servant, const CORBA_char* who, CORBA_double lease,
                          CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return CORBA_OBJECT_NIL;
  Corbot_Arm reference = inner.Acquire(servant, who, lease, ev);
  requests_leave(self_of(servant)->target);
  return reference;
}

static void release(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Release(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void cancel(PortableServer_Servant servant, Corbot_Ticket id, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Cancel(servant, id, ev);
  requests_leave(self_of(servant)->target);
}

static void pause_motion(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Pause(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void resume(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Resume(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void set_override(PortableServer_Servant servant, CORBA_double percent, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Override(servant, percent, ev);
  requests_leave(self_of(servant)->target);
}

static void clear(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.Clear(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void set_soft_limits(PortableServer_Servant servant, const Corbot_JointRanges* limits,
                            CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.SetSoftLimits(servant, limits, ev);
  requests_leave(self_of(servant)->target);
}

static void reset_soft_limits(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.ResetSoftLimits(servant, ev);
  requests_leave(self_of(servant)->target);
}

static void set_workspace(PortableServer_Servant servant, const Corbot_WorkspaceShapes* further,
                          CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.SetWorkspace(servant, further, ev);
  requests_leave(self_of(servant)->target);
}

static void reset_workspace(PortableServer_Servant servant, CORBA_Environment* ev) {
  if (is_refused(servant, ev)) return;
  inner.ResetWorkspace(servant, ev);
  requests_leave(self_of(servant)->target);
}

void arm_bound(POA_Corbot_Arm__epv* arm) {
  inner = *arm;
  arm->Stop = stop;
  arm->StopAndHold = stop_and_hold;
  arm->Acquire = acquire;
  arm->Release = release;
  arm->Cancel = cancel;
  arm->Pause = pause_motion;
  arm->Resume = resume;
  arm->Override = set_override;
  arm->Clear = clear;
  arm->SetSoftLimits = set_soft_limits;
  arm->ResetSoftLimits = reset_soft_limits;
  arm->SetWorkspace = set_workspace;
  arm->ResetWorkspace = reset_workspace;
}
