/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "orb/orbit2/calls.h"

#include <dlfcn.h>
#include <glib.h>
#include <string.h>

#include "net/arrivals.h"
#include "net/places.h"

/* Replaces ORBit2's function. */
void ORBit_small_invoke_adaptor(void* object, void* request, void* method, void* data, CORBA_Environment* ev);

static GMutex mutex;
static GHashTable* calls; /* Call by request */
static _Thread_local Call current;

Call calls_begin(void* request, corbot_counted_stop counted, corbot_connection connection, const void* key,
                 size_t length) {
  Call* call = g_new0(Call, 1);
  call->connection = connection;
  call->stops = corbot_arrival();
  call->counted = counted;
  if (key != NULL) corbot_read_key(key, length, call->key);
  g_mutex_lock(&mutex);
  if (calls == NULL) calls = g_hash_table_new_full(NULL, NULL, NULL, g_free);
  g_hash_table_replace(calls, request, call);
  const Call copy = *call;
  g_mutex_unlock(&mutex);
  return copy;
}

void calls_end(void* request) {
  g_mutex_lock(&mutex);
  if (calls != NULL) g_hash_table_remove(calls, request);
  g_mutex_unlock(&mutex);
}

bool calls_idle(void) {
  g_mutex_lock(&mutex);
  const bool idle = calls == NULL || g_hash_table_size(calls) == 0;
  g_mutex_unlock(&mutex);
  return idle;
}

/* Runs in the thread that serves the request. */
void ORBit_small_invoke_adaptor(void* object, void* request, void* method, void* data,
                                CORBA_Environment* ev) {
  static void (*real)(void*, void*, void*, void*, CORBA_Environment*);
  if (real == NULL) *(void**)&real = dlsym(RTLD_NEXT, "ORBit_small_invoke_adaptor");
  if (real == NULL) g_error("this ORBit2 has no ORBit_small_invoke_adaptor");
  g_mutex_lock(&mutex);
  const Call* call = calls != NULL ? g_hash_table_lookup(calls, request) : NULL;
  if (call != NULL) current = *call;
  g_mutex_unlock(&mutex);
  real(object, request, method, data, ev);
  memset(&current, 0, sizeof(current));
}

/* Returns the presence of the client of a call that has a slot. */
static int presence(void* servant) {
  const int place = self_of(servant)->target;
  if (!corbot_place_wanted(place)) return CORBOT_CALLER_GONE;
  return corbot_place_may_stay(place) ? CORBOT_CALLER_PRESENT : CORBOT_CALLER_CROWDED;
}

const corbot_caller* caller_of_call(const Call* call, Caller* room) {
  memset(room, 0, sizeof(*room));
  room->call = *call;
  corbot_connection_peer_text(room->call.connection, room->from);
  room->caller.places = CORBOT_HOST_PLACES;
  room->caller.key = room->call.key;
  room->caller.from = room->from;
  room->caller.stops = room->call.stops;
  room->caller.counted = room->call.counted;
  return &room->caller;
}

const corbot_caller* caller_of(PortableServer_Servant servant, Caller* room) {
  (void)caller_of_call(&current, room);
  if (self_of(servant)->target < CORBOT_PLACES) {
    room->caller.present = presence;
    room->caller.context = servant;
  }
  return &room->caller;
}
