/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_WAITING_CALLS_H
#define CORBOT_ORBIT2_WAITING_CALLS_H

#include <stdatomic.h>
#include <stdbool.h>

/* How many calls may wait for motions at once. The bound has two reasons. Every waiting call holds a thread,
 * and nothing else in ORBit2 limits those. And an omniORB client has five connections to a server, one call
 * each: while four calls wait at most, the fifth connection is free for its Stop. (On omniORB a call too many
 * is forwarded to another address; an ORBit2 servant cannot forward a call.) Thread-safe. */
typedef struct WaitingCalls {
  atomic_int held;
  int capacity;
} WaitingCalls;

enum { kWaitingCallsByDefault = 4, kWaitingCallsAtMost = 64 };

void waiting_calls_init(WaitingCalls* calls, int capacity);
/* False when `capacity` calls wait already. */
bool waiting_calls_enter(WaitingCalls* calls);
void waiting_calls_leave(WaitingCalls* calls);
bool waiting_calls_idle(WaitingCalls* calls);

#endif /* CORBOT_ORBIT2_WAITING_CALLS_H */
