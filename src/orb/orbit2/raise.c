/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/raise.h"

void raise_bad_parameter(const char* parameter, double value, const char* reason, CORBA_Environment* ev) {
  Corbot_BadParameter* raised = Corbot_BadParameter__alloc();
  raised->parameter = CORBA_string_dup(parameter);
  raised->value = value;
  raised->reason = CORBA_string_dup(reason);
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_BadParameter, raised);
}

void raise_queue_full(int capacity, CORBA_Environment* ev) {
  Corbot_QueueFull* raised = Corbot_QueueFull__alloc();
  raised->capacity = capacity;
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_QueueFull, raised);
}

static void raise_unreachable(const corbot_error* error, CORBA_Environment* ev) {
  Corbot_Unreachable* raised = Corbot_Unreachable__alloc();
  raised->target.x = error->target_m[0];
  raised->target.y = error->target_m[1];
  raised->target.z = error->target_m[2];
  raised->reason = CORBA_string_dup(error->text);
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_Unreachable, raised);
}

static void raise_limit_exceeded(const corbot_error* error, CORBA_Environment* ev) {
  Corbot_LimitExceeded* raised = Corbot_LimitExceeded__alloc();
  raised->quantity = CORBA_string_dup(error->parameter);
  raised->articulation = error->joint;
  raised->value = error->value;
  raised->lower = error->lower;
  raised->upper = error->upper;
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_LimitExceeded, raised);
}

static void raise_not_ready(const corbot_error* error, CORBA_Environment* ev) {
  Corbot_NotReady* raised = Corbot_NotReady__alloc();
  raised->reason = CORBA_string_dup(error->text);
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_NotReady, raised);
}

static void raise_stopped(const corbot_error* error, CORBA_Environment* ev) {
  Corbot_Stopped* raised = Corbot_Stopped__alloc();
  raised->reason = CORBA_string_dup(error->text);
  CORBA_exception_set(ev, CORBA_USER_EXCEPTION, ex_Corbot_Stopped, raised);
}

void raise_failure(const corbot_error* error, CORBA_Environment* ev) {
  switch (error->status) {
    case CORBOT_BAD_PARAMETER:
      raise_bad_parameter(error->parameter, error->value, error->text, ev);
      return;
    case CORBOT_UNREACHABLE:
      raise_unreachable(error, ev);
      return;
    case CORBOT_LIMIT_EXCEEDED:
      raise_limit_exceeded(error, ev);
      return;
    case CORBOT_NOT_READY:
      raise_not_ready(error, ev);
      return;
    case CORBOT_STOPPED:
      raise_stopped(error, ev);
      return;
    case CORBOT_QUEUE_FULL:
      raise_queue_full(error->capacity, ev);
      return;
    case CORBOT_NO_DATA:
      CORBA_exception_set_system(ev, ex_CORBA_TRANSIENT, CORBA_COMPLETED_NO);
      return;
    case CORBOT_OK:
    case CORBOT_INTERNAL:
      break;
  }
  CORBA_exception_set_system(ev, ex_CORBA_INTERNAL, CORBA_COMPLETED_MAYBE);
}

void raise_failure_of_setting(const corbot_error* error, const char* key, CORBA_Environment* ev) {
  if (error->status != CORBOT_NOT_READY) {
    raise_failure(error, ev);
    return;
  }
  CORBA_exception_set_system(ev, ex_CORBA_NO_PERMISSION, CORBA_COMPLETED_NO);
  CORBA_SystemException* raised = CORBA_exception_value(ev);
  raised->minor = *key == '\0' ? Corbot_NoPermissionNoControl : Corbot_NoPermissionControlEnded;
}
