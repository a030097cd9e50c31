/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_CALLS_H
#define CORBOT_ORBIT2_CALLS_H

#include <stdbool.h>
#include <stddef.h>

#include "net/connections.h"
#include "orb/orbit2/arm_instance.h"
#include "robot/corbot_robot.h"

/* The properties of a request while its operation is carried out. ORBit2 reads requests in one thread, serves
 * them in others, and passes no information on the source of a request to the operation. */
typedef struct Call {
  corbot_connection connection;
  uint64_t stops; /* number at its arrival, see corbot_caller */
  corbot_counted_stop counted;
  /* Key in the called reference, see corbot_read_key; "": the public reference. */
  char key[CORBOT_KEY];
} Call;

/* Notes a request to one of our objects, in the I/O thread, which has just read it. `counted`: the Stop, if
 * it was counted. `key`: NULL for the public reference. */
Call calls_begin(void* request, corbot_counted_stop counted, corbot_connection connection, const void* key,
                 size_t length);
/* Removes a request. No effect on other requests. */
void calls_end(void* request);
/* Returns true if no request is being served. */
bool calls_idle(void);

/* The client of this thread's call, for corbot_robot.h, in *room. The `Caller` must live as long as the
 * result is used. */
typedef struct Caller {
  corbot_caller caller;
  Call call;
  char from[CORBOT_PEER_TEXT];
} Caller;
const corbot_caller* caller_of(PortableServer_Servant servant, Caller* room);
/* Does the same for a call that is still in the I/O thread. */
const corbot_caller* caller_of_call(const Call* call, Caller* room);

#endif /* CORBOT_ORBIT2_CALLS_H */
