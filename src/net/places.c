/* SPDX-License-Identifier: Apache-2.0 */
#include "net/places.h"

#include <pthread.h>
#include <stddef.h>
#include <string.h>

typedef struct Place {
  bool taken;
  corbot_connection connection;
  corbot_peer peer;
} Place;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static Place places[CORBOT_PLACES]; /* first those to wait, then those to start */

bool corbot_place_needed(const char* operation, corbot_place_kind* kind) {
  static const char* const waits[] = {"Move",  "MoveS", "MoveC", "MoveJoints", "Drive",
                                      "Ready", "Delay", "Open",  "Close",      "Wait"};
  static const char starts[] = "Start";
  if (strncmp(operation, starts, sizeof(starts) - 1) == 0) {
    *kind = CORBOT_PLACE_TO_START;
    return true;
  }
  for (size_t i = 0; i < sizeof(waits) / sizeof(waits[0]); ++i) {
    if (strcmp(operation, waits[i]) != 0) continue;
    *kind = CORBOT_PLACE_TO_WAIT;
    return true;
  }
  return false;
}

static int take(corbot_place_kind kind, corbot_connection connection, corbot_peer peer, int* capacity) {
  const int first = kind == CORBOT_PLACE_TO_WAIT ? 0 : CORBOT_WAITING;
  const int end = kind == CORBOT_PLACE_TO_WAIT ? CORBOT_WAITING : CORBOT_PLACES;
  int of_peer = 0;
  int found = -1;
  for (int i = first; i < end; ++i) {
    if (!places[i].taken) {
      if (found < 0) found = i;
    } else {
      of_peer += corbot_peer_equal(places[i].peer, peer);
    }
  }
  *capacity = end - first;
  if (kind == CORBOT_PLACE_TO_WAIT && of_peer >= CORBOT_WAITING_A_HOST) {
    *capacity = CORBOT_WAITING_A_HOST;
    return -1;
  }
  if (found < 0) return -1;
  places[found].taken = true;
  places[found].connection = connection;
  places[found].peer = peer;
  return found;
}

int corbot_place_take(corbot_place_kind kind, corbot_connection connection, int* capacity) {
  *capacity = 0;
  if (!corbot_connection_begin_call(connection)) return -1;
  const corbot_peer peer = corbot_connection_peer(connection);
  pthread_mutex_lock(&mutex);
  const int place = take(kind, connection, peer, capacity);
  pthread_mutex_unlock(&mutex);
  if (place < 0) corbot_connection_end_call(connection);
  return place;
}

void corbot_place_free(int place) {
  pthread_mutex_lock(&mutex);
  const corbot_connection connection = places[place].connection;
  places[place].taken = false;
  pthread_mutex_unlock(&mutex);
  corbot_connection_end_call(connection);
}

/* The place is the caller's own. */
bool corbot_place_wanted(int place) { return corbot_connection_lives(places[place].connection); }

bool corbot_places_idle(void) {
  bool idle = true;
  pthread_mutex_lock(&mutex);
  for (int i = 0; i < CORBOT_WAITING; ++i) idle = idle && !places[i].taken;
  pthread_mutex_unlock(&mutex);
  return idle;
}
