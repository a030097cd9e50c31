/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_CALLS_H
#define CORBOT_ORBIT2_CALLS_H

#include <stdbool.h>
#include <stddef.h>

#include "net/connections.h"
#include "orb/orbit2/arm_instance.h"
#include "robot/corbot_robot.h"

/* What is known of a request when its operation is carried out. ORBit2 reads requests in one thread, serves them in
 * others, and passes an operation nothing of where its request came from. */
typedef struct Call {
  corbot_connection connection;
  uint64_t stops; /* when it arrived, see corbot_caller */
  corbot_counted_stop counted;
  /* Of the reference that was called, see corbot_read_key; "": the public one. */
  char key[CORBOT_KEY];
} Call;

/* In the I/O thread, which has just read it: the request goes to an object of ours. `counted` says
 * whether it is a Stop that was counted. `key`: NULL for the public reference. */
Call calls_begin(void* request, corbot_counted_stop counted, corbot_connection connection, const void* key,
                 size_t length);
/* Without effect for other requests. */
void calls_end(void* request);
/* No request is being served. */
bool calls_idle(void);

/* The client of the call that this thread carries out, for corbot_robot.h, in *room: `Caller` lives as long as it is
 * used. */
typedef struct Caller {
  corbot_caller caller;
  Call call;
  char from[CORBOT_PEER_TEXT];
} Caller;
const corbot_caller* caller_of(PortableServer_Servant servant, Caller* room);
/* The same of a call that is still in the I/O thread. */
const corbot_caller* caller_of_call(const Call* call, Caller* room);

#endif /* CORBOT_ORBIT2_CALLS_H */
