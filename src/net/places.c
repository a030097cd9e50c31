/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "net/places.h"

#include <pthread.h>
#include <stddef.h>
#include <string.h>
#include <time.h>

typedef struct Place {
  bool taken;
  bool lasting;      /* one of CORBOT_HOST_PLACES */
  int64_t asked_ns;  /* time of the last check whether it may stay; at first, when it was taken */
  int64_t lasted_ns; /* running time of this process until then */
  corbot_connection connection;
  corbot_peer peer;
} Place;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static Place places[CORBOT_PLACES]; /* kind after kind */

static const int64_t kBrief_ns = CORBOT_BRIEF_MS * INT64_C(1000000);
/* Most time that counts between two checks: a suspended machine has delayed all calls. */
static const int64_t kLongestLook_ns = CORBOT_BRIEF_MS * INT64_C(1000000) / 2;

/* Number of slots of each kind, and of the slots that the calls of one host may have. */
static const struct {
  int count;
  int of_host;
} kBounds[] = {{CORBOT_WAITING, CORBOT_HOST_PLACES},
               {CORBOT_STARTING, CORBOT_STARTING},
               {CORBOT_CHANGING, CORBOT_CHANGING_A_HOST},
               {CORBOT_STOPPING, CORBOT_STOPPING}};

_Static_assert(CORBOT_CHANGING_A_HOST == 4 && CORBOT_CHANGING == 8, "the text below names both");
const char kChangesRefused[] =
    "too many calls at once that wait for the real-time task, 4 of a host and 8 of all are allowed; call "
    "again";

bool corbot_place_needed(const char* operation, corbot_place_kind* kind) {
  static const struct {
    const char* operation;
    corbot_place_kind kind;
  } needed[] = {
      {"Move", CORBOT_PLACE_TO_WAIT},
      {"MoveS", CORBOT_PLACE_TO_WAIT},
      {"MoveC", CORBOT_PLACE_TO_WAIT},
      {"MoveJoints", CORBOT_PLACE_TO_WAIT},
      {"Drive", CORBOT_PLACE_TO_WAIT},
      {"Ready", CORBOT_PLACE_TO_WAIT},
      {"Delay", CORBOT_PLACE_TO_WAIT},
      {"Open", CORBOT_PLACE_TO_WAIT},
      {"Close", CORBOT_PLACE_TO_WAIT},
      {"Wait", CORBOT_PLACE_TO_WAIT},
      {"Stop", CORBOT_PLACE_TO_STOP},
      {"Cancel", CORBOT_PLACE_TO_CHANGE},
      {"Clear", CORBOT_PLACE_TO_CHANGE},
      {"Pause", CORBOT_PLACE_TO_CHANGE},
      {"Resume", CORBOT_PLACE_TO_CHANGE},
      {"Override", CORBOT_PLACE_TO_CHANGE},
      {"Acquire", CORBOT_PLACE_TO_CHANGE},
      {"Release", CORBOT_PLACE_TO_CHANGE},
      {"StopAndHold", CORBOT_PLACE_TO_STOP},
      {"SetGripper", CORBOT_PLACE_TO_WAIT},
      {"MovePose", CORBOT_PLACE_TO_WAIT},
      {"MovePoseS", CORBOT_PLACE_TO_WAIT},
      {"MoveRelative", CORBOT_PLACE_TO_WAIT},
      {"MoveRelativeS", CORBOT_PLACE_TO_WAIT},
      {"SetSoftLimits", CORBOT_PLACE_TO_CHANGE},
      {"ResetSoftLimits", CORBOT_PLACE_TO_CHANGE},
      {"SetWorkspace", CORBOT_PLACE_TO_CHANGE},
      {"ResetWorkspace", CORBOT_PLACE_TO_CHANGE},
  };
  static const char starts[] = "Start";
  if (strncmp(operation, starts, sizeof(starts) - 1) == 0) {
    *kind = CORBOT_PLACE_TO_START;
    return true;
  }
  for (size_t i = 0; i < sizeof(needed) / sizeof(needed[0]); ++i) {
    if (strcmp(operation, needed[i].operation) != 0) continue;
    *kind = needed[i].kind;
    return true;
  }
  return false;
}

bool corbot_is_stop(const char* operation, bool* hold) {
  *hold = strcmp(operation, "StopAndHold") == 0;
  return *hold || strcmp(operation, "Stop") == 0;
}

static int64_t now_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Returns true if another call of the host may last. The caller holds the mutex. */
static bool may_last(corbot_peer peer) {
  int lasting = 0;
  for (int i = 0; i < CORBOT_PLACES; ++i)
    lasting += places[i].taken && places[i].lasting && corbot_peer_equal(places[i].peer, peer);
  return lasting < CORBOT_HOST_PLACES;
}

static int take(corbot_place_kind kind, corbot_connection connection, corbot_peer peer, int* capacity) {
  int first = 0;
  for (int before = 0; before < (int)kind; ++before) first += kBounds[before].count;
  const int end = first + kBounds[kind].count;
  const bool lasts = kind == CORBOT_PLACE_TO_WAIT;
  int of_peer = 0;
  int found = -1;
  for (int i = first; i < end; ++i) {
    if (!places[i].taken) {
      if (found < 0) found = i;
    } else {
      of_peer += corbot_peer_equal(places[i].peer, peer);
    }
  }
  const bool host_is_full = of_peer >= kBounds[kind].of_host || (lasts && !may_last(peer));
  *capacity = host_is_full ? kBounds[kind].of_host : kBounds[kind].count;
  if (host_is_full || found < 0) return -1;
  const Place taken = {true, lasts, now_ns(), 0, connection, peer};
  places[found] = taken;
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

/* The slot belongs to the caller, so no lock is needed. */
bool corbot_place_wanted(int place) { return corbot_connection_lives(places[place].connection); }

bool corbot_place_may_stay(int place) {
  bool stays = true;
  pthread_mutex_lock(&mutex);
  Place* of_call = &places[place];
  const bool is_stop = place >= CORBOT_PLACES - CORBOT_STOPPING;
  if (!is_stop && !of_call->lasting) {
    const int64_t now = now_ns();
    const int64_t look = now - of_call->asked_ns;
    of_call->asked_ns = now;
    of_call->lasted_ns += look < kLongestLook_ns ? look : kLongestLook_ns;
    if (of_call->lasted_ns >= kBrief_ns) stays = of_call->lasting = may_last(of_call->peer);
  }
  pthread_mutex_unlock(&mutex);
  return stays;
}

bool corbot_places_idle(void) {
  bool idle = true;
  pthread_mutex_lock(&mutex);
  for (int i = 0; i < CORBOT_WAITING; ++i) idle = idle && !places[i].taken;
  pthread_mutex_unlock(&mutex);
  return idle;
}
