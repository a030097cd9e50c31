/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_REQUESTS_H
#define CORBOT_ORBIT2_REQUESTS_H

#include <glib.h>

#include "net/places.h"
#include "robot/corbot_robot.h"

/* Between ORBit2's I/O thread and its object adaptors. ORBit2 gives its objects keys that end with the
 * process, and would serve a key of our choice only by forwarding the client (LOCATION_FORWARD); a client's
 * ORB may send a forwarded call again when its connection is lost. And it makes a thread for every request,
 * before the servant can refuse. So this file takes the place of some of the library's own functions: a
 * request for the robot's name, or for a reference of exclusive control (NAME/KEY), is given the key of one of
 * the objects below and goes on as if it had come with that; calls.h keeps the KEY. */

/* The objects, all for the same robot. A call that does not return at once has a place, and an object for
 * that place; one that finds no place goes to an object that refuses it, all of those served by one thread.
 * A Stop or StopAndHold is counted when it arrives. One without a place goes to an object with a thread of its own, which
 * waits for the end or holds. */
enum {
  kTargetRefuseHost = CORBOT_PLACES, /* this host's places are taken */
  kTargetRefuseWait,                 /* all are */
  kTargetRefuseStart,
  kTargetRefuseChange,
  kTargetJoinStop,
  kTargetAtOnce, /* whatever needs no place */
  kTargets
};

/* Requests for `name` and for NAME/... go to the objects with these keys, which are kept. Before corbot_connections_serve(). */
void requests_serve(const char* name, GByteArray* const keys[kTargets], corbot_robot* robot);
/* The call of this place is over; without effect when that is known. */
void requests_leave(int place);

#endif /* CORBOT_ORBIT2_REQUESTS_H */
