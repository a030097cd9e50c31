/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_REQUESTS_H
#define CORBOT_ORBIT2_REQUESTS_H

#include <glib.h>

#include "net/places.h"
#include "robot/corbot_robot.h"

/* Connects ORBit2's I/O thread with its object adaptors. ORBit2's object keys end with the process. It serves
 * a fixed key only by forwarding the client (LOCATION_FORWARD), and a client's ORB may repeat a forwarded
 * call when its connection is lost. ORBit2 also creates a thread for every request, before the servant can
 * refuse it. This file therefore replaces some of the library's functions. A request for the robot's name, or
 * for a reference of exclusive control (NAME/KEY), gets the key of one of the objects below. It then
 * continues as if it had come with that key; calls.h stores the KEY. */

/* The objects, all for the same robot. A call that does not return at once has a slot, and an object for that
 * slot. Without a free slot it goes to an object that refuses it; one thread serves all of these. A Stop or
 * StopAndHold is counted when it arrives. Without a slot it goes to an object with its own thread, which
 * waits for the end or holds. */
enum {
  kTargetRefuseHost = CORBOT_PLACES, /* all slots of this host are taken */
  kTargetRefuseWait,                 /* all slots are taken */
  kTargetRefuseStart,
  kTargetRefuseChange,
  kTargetJoinStop,
  kTargetAtOnce, /* a call that needs no slot */
  kTargets
};

/* Directs requests for `name` and for NAME/... to the objects with these keys, which it keeps. To be called
 * before corbot_connections_serve(). */
void requests_serve(const char* name, GByteArray* const keys[kTargets], corbot_robot* robot);
/* Ends the call of this slot; no effect if it is known to have ended. */
void requests_leave(int place);

#endif /* CORBOT_ORBIT2_REQUESTS_H */
