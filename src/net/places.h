/* SPDX-License-Identifier: Apache-2.0
 *
 * Slots for the calls that do not return at once, the same for both servants. They bound two resources. The
 * first is the threads that such calls occupy: each kind has its own slots, so no kind blocks another. The
 * second is the connections of a client that they block: at most CORBOT_HOST_PLACES calls of a host, of any
 * kinds, last longer than a moment. A call that waits for a motion counts from its beginning. A call that
 * starts a motion or changes how the arm moves normally takes a few milliseconds; it counts after
 * CORBOT_BRIEF_MS. A Stop never counts. Plain C, thread-safe, not real-time safe. */
#ifndef CORBOT_NET_PLACES_H
#define CORBOT_NET_PLACES_H

#include <stdbool.h>

#include "net/connections.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  /* A client's ORB opens at most five connections to a server and carries one call on each (omniORB without
   * options). If four are blocked, one is free for Stop, after CORBOT_BRIEF_MS at the latest. */
  CORBOT_HOST_PLACES = 4,
  CORBOT_BRIEF_MS = 20,
  CORBOT_WAITING = 32,
  /* The planner makes one plan at a time; these calls wait for their turn. */
  CORBOT_STARTING = 16,
  /* Cancel, Clear, Pause, Resume, Override and Release wait until the real-time task has read them. Acquire
   * waits until no call of other clients is being planned. */
  CORBOT_CHANGING = 8,
  CORBOT_CHANGING_A_HOST = 4, /* one host leaves some slots for others */
  /* A Stop or StopAndHold without a slot is still carried out: it waits with those that have one. */
  CORBOT_STOPPING = 8,
  CORBOT_PLACES = CORBOT_WAITING + CORBOT_STARTING + CORBOT_CHANGING + CORBOT_STOPPING
};

typedef enum corbot_place_kind {
  CORBOT_PLACE_TO_WAIT,
  CORBOT_PLACE_TO_START,
  CORBOT_PLACE_TO_CHANGE,
  CORBOT_PLACE_TO_STOP
} corbot_place_kind;

/* Reason in the refusal of a call of CORBOT_PLACE_TO_CHANGE, for its client. */
extern const char kChangesRefused[];

/* Returns the kind of slot that an operation of Corbot::Arm needs; false: none, as it returns at once. */
bool corbot_place_needed(const char* operation, corbot_place_kind* kind);

/* Returns true if an operation of Corbot::Arm is a Stop, which is counted when its request arrives. *hold is
 * true for a StopAndHold. */
bool corbot_is_stop(const char* operation, bool* hold);

/* Takes a slot for a call on that connection, 0 to CORBOT_PLACES - 1. Returns -1 if none is free; *capacity
 * is then the exhausted number, of the host or of all. A connection with a call that has a slot is not idle.
 */
int corbot_place_take(corbot_place_kind kind, corbot_connection connection, int* capacity);
void corbot_place_free(int place);
/* Returns true if the client whose call has this slot is still connected. */
bool corbot_place_wanted(int place);
/* Returns true if the call may last longer; polled every few milliseconds. False: the call has lasted
 * CORBOT_BRIEF_MS, and other calls of its host have all slots for longer calls. */
bool corbot_place_may_stay(int place);
/* Returns true if no call waits. */
bool corbot_places_idle(void);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_PLACES_H */
