/* SPDX-License-Identifier: Apache-2.0
 *
 * Places for the calls that do not return at once: what bounds the threads that they hold, the same for
 * both servants. Each kind has its own, so none shuts out another. Plain C, thread-safe, not real-time
 * safe. */
#ifndef CORBOT_NET_PLACES_H
#define CORBOT_NET_PLACES_H

#include <stdbool.h>

#include "net/connections.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  /* A client's ORB opens at most five connections to a server and carries one call on each (omniORB without
   * options): with four waiting calls a host, one connection is free for Stop. */
  CORBOT_WAITING_A_HOST = 4,
  CORBOT_WAITING = 32,
  /* Plans are made one after the other; these wait for their turn. */
  CORBOT_STARTING = 16,
  /* Cancel, Clear, Pause, Resume, Override, Release: they wait until the real-time task has seen them; Acquire,
   * until no call of others is being planned. */
  CORBOT_CHANGING = 8,
  CORBOT_CHANGING_A_HOST = 4,
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

/* A place for a call that came on that connection, 0 to CORBOT_PLACES - 1; -1 when there is none, and in
 * *capacity how many there are. A connection with a call that has a place is not idle. */
int corbot_place_take(corbot_place_kind kind, corbot_connection connection, int* capacity);
void corbot_place_free(int place);
/* Whether the client whose call has this place is still there. */
bool corbot_place_wanted(int place);
/* No call waits. */
bool corbot_places_idle(void);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_PLACES_H */
