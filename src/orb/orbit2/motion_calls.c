/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/motion_calls.h"

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/raise.h"
#include "orb/orbit2/requests.h"

bool motion_has_place(PortableServer_Servant servant, CORBA_Environment* ev) {
  switch (self_of(servant)->target) {
    case kTargetRefuseHost:
      raise_queue_full(CORBOT_HOST_PLACES, ev);
      return false;
    case kTargetRefuseWait:
      raise_queue_full(CORBOT_WAITING, ev);
      return false;
    case kTargetRefuseStart:
      raise_queue_full(CORBOT_STARTING, ev);
      return false;
    case kTargetRefuseChange: /* no such call reaches this object */
    case kTargetJoinStop:
    case kTargetAtOnce:
      CORBA_exception_set_system(ev, ex_CORBA_INTERNAL, CORBA_COMPLETED_NO);
      return false;
    default:
      return true;
  }
}

Corbot_Ticket motion_started(PortableServer_Servant servant, corbot_status status,
                             const corbot_ticket* ticket, const corbot_error* error, CORBA_Environment* ev) {
  if (self_of(servant)->target >= CORBOT_WAITING && self_of(servant)->target < CORBOT_PLACES)
    requests_leave(self_of(servant)->target);
  if (status == CORBOT_OK) return *ticket;
  raise_failure(error, ev);
  return 0;
}

void motion_finish(PortableServer_Servant servant, Corbot_Ticket ticket, CORBA_Environment* ev) {
  if (ev->_major == CORBA_NO_EXCEPTION) {
    Caller room;
    const corbot_caller* caller = caller_of(servant, &room);
    corbot_error error;
    if (corbot_robot_finish(self_of(servant)->robot, ticket, caller, &error) != CORBOT_OK) {
      raise_failure(&error, ev);
    }
  }
  if (self_of(servant)->target < CORBOT_PLACES) requests_leave(self_of(servant)->target);
}
