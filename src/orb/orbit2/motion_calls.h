/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_MOTION_CALLS_H
#define CORBOT_ORBIT2_MOTION_CALLS_H

#include <arm.h>
#include <stdbool.h>

#include "robot/corbot_robot.h"

/* What all operations that start a motion have in common. */

/* Whether the call has a place; if not, it is refused, and starts nothing. */
bool motion_has_place(PortableServer_Servant servant, CORBA_Environment* ev);
/* The end of every operation that starts a motion. */
Corbot_Ticket motion_started(PortableServer_Servant servant, corbot_status status,
                             const corbot_ticket* ticket, const corbot_error* error, CORBA_Environment* ev);
/* The end of the calls that return when their motion has ended. */
void motion_finish(PortableServer_Servant servant, Corbot_Ticket ticket, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_MOTION_CALLS_H */
