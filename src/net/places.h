/* SPDX-License-Identifier: Apache-2.0
 *
 * Places for the calls that do not return at once, the same for both servants. They bound two things. The threads that
 * such calls hold: each kind has places of its own, so none shuts out another. And the connections of a client that
 * they block: of a host no more than CORBOT_HOST_PLACES calls, of whatever kinds, last longer than a moment. A call that
 * waits for a motion is one of those from its beginning; one that starts a motion or changes how the arm moves, which
 * takes a few milliseconds where nothing is wrong, from CORBOT_BRIEF_MS on. A Stop never is. Plain C, thread-safe, not
 * real-time safe. */
#ifndef CORBOT_NET_PLACES_H
#define CORBOT_NET_PLACES_H

#include <stdbool.h>

#include "net/connections.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  /* A client's ORB opens at most five connections to a server and carries one call on each (omniORB without
   * options): with four that are blocked, one is free for Stop, CORBOT_BRIEF_MS later at the latest. */
  CORBOT_HOST_PLACES = 4,
  CORBOT_BRIEF_MS = 20,
  CORBOT_WAITING = 32,
  /* Plans are made one after the other; these wait for their turn. */
  CORBOT_STARTING = 16,
  /* Cancel, Clear, Pause, Resume, Override, Release: they wait until the real-time task has seen them; Acquire,
   * until no call of others is being planned. */
  CORBOT_CHANGING = 8,
  CORBOT_CHANGING_A_HOST = 4, /* so that one host leaves some for others */
  /* A Stop or StopAndHold without a place is carried out all the same: it waits with those that have one. */
  CORBOT_STOPPING = 8,
  CORBOT_PLACES = CORBOT_WAITING + CORBOT_STARTING + CORBOT_CHANGING + CORBOT_STOPPING
};

typedef enum corbot_place_kind {
  CORBOT_PLACE_TO_WAIT,
  CORBOT_PLACE_TO_START,
  CORBOT_PLACE_TO_CHANGE,
  CORBOT_PLACE_TO_STOP
} corbot_place_kind;

/* Why a call of CORBOT_PLACE_TO_CHANGE is refused, to its client. */
extern const char kChangesRefused[];

/* What an operation of Corbot::Arm needs; false: none, it returns at once. */
bool corbot_place_needed(const char* operation, corbot_place_kind* kind);

/* This says whether an operation of Corbot::Arm is a Stop, which is counted where its request arrives. *hold says whether it
 * is a StopAndHold. */
bool corbot_is_stop(const char* operation, bool* hold);

/* A place for a call that came on that connection, 0 to CORBOT_PLACES - 1; -1 when there is none, and in
 * *capacity the number that is exhausted, of its host or of all. A connection with a call that has a place is not idle. */
int corbot_place_take(corbot_place_kind kind, corbot_connection connection, int* capacity);
void corbot_place_free(int place);
/* Whether the client whose call has this place is still there. */
bool corbot_place_wanted(int place);
/* Whether the call may last longer; asked every few milliseconds while it does. False: it has had its moment, and other
 * calls of its host have all the places for those that last longer. */
bool corbot_place_may_stay(int place);
/* No call waits. */
bool corbot_places_idle(void);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_PLACES_H */
