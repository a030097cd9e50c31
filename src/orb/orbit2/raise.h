/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_RAISE_H
#define CORBOT_ORBIT2_RAISE_H

#include <arm.h>

#include "robot/corbot_robot.h"

/* Failures as the exceptions that the interface names for them. The environment owns what is raised. ORBit2
 * takes no NULL for a string: there is none in a corbot_error. */
void raise_failure(const corbot_error* error, CORBA_Environment* ev);
/* The same for an operation that has no NotReady, as NO_PERMISSION; `key`: of the reference that was called. */
void raise_failure_of_setting(const corbot_error* error, const char* key, CORBA_Environment* ev);
void raise_bad_parameter(const char* parameter, double value, const char* reason, CORBA_Environment* ev);
void raise_queue_full(int capacity, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_RAISE_H */
