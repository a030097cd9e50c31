/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_MOTION_CALLS_H
#define CORBOT_ORBIT2_MOTION_CALLS_H

#include <arm.h>
#include <stdbool.h>

#include "robot/corbot_robot.h"

/* Common parts of all operations that start a motion. */

/* Returns true if the call has a slot; else refuses the call, which then starts nothing. */
bool motion_has_place(PortableServer_Servant servant, CORBA_Environment* ev);
/* Ends every operation that starts a motion. */
Corbot_Ticket motion_started(PortableServer_Servant servant, corbot_status status,
                             const corbot_ticket* ticket, const corbot_error* error, CORBA_Environment* ev);
/* Ends the calls that return when their motion has ended. */
void motion_finish(PortableServer_Servant servant, Corbot_Ticket ticket, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_MOTION_CALLS_H */
