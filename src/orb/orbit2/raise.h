/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_RAISE_H
#define CORBOT_ORBIT2_RAISE_H

#include <arm.h>

#include "robot/corbot_robot.h"

/* Raise failures as the interface's exceptions. The environment owns the exception. ORBit2 accepts no NULL
 * string; a corbot_error contains none. */
void raise_failure(const corbot_error* error, CORBA_Environment* ev);
/* Does the same, as NO_PERMISSION, for an operation that does not raise NotReady. `key`: key in the called
 * reference. */
void raise_failure_of_setting(const corbot_error* error, const char* key, CORBA_Environment* ev);
void raise_bad_parameter(const char* parameter, double value, const char* reason, CORBA_Environment* ev);
void raise_queue_full(int capacity, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_RAISE_H */
