/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "orb/orbit2/requests.h"

#include <dlfcn.h>
#include <errno.h>
#include <glib-object.h>
#include <orbit/orbit.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include "net/arrivals.h"
#include "net/connections.h"
#include "orb/orbit2/calls.h"

/* Exported by ORBit2 without a public declaration. */
extern CORBA_sequence_CORBA_octet* giop_recv_buffer_get_objkey(void* request);
extern char* giop_recv_buffer_get_opname(void* request);
extern void* link_connection_ref(void* connection);
extern void link_connection_unref(void* connection);

/* A function that carries out an operation. */
typedef void (*Skeleton)(PortableServer_Servant servant, gpointer result, gpointer* arguments,
                         gpointer context, CORBA_Environment* ev, gpointer implementation);

/* Replace ORBit2's functions. */
void link_connection_from_fd(void* connection, int fd, const void* protocol, char* host, char* service,
                             gboolean initiated, int status, int options);
gboolean giop_connection_handle_input(void* connection);
void ORBit_handle_request(CORBA_ORB orb, void* request);
void ORBit_handle_locate_request(CORBA_ORB orb, void* request);
void giop_recv_buffer_unuse(void* request);
/* NOLINTNEXTLINE(readability-identifier-naming): ORBit2's name */
Skeleton get_small_skel_CORBA_Object(PortableServer_Servant servant, const char* operation, gpointer* method,
                                     gpointer* implementation);

static char* served_name;
static GByteArray* keys[kTargets];
/* The connection whose input this thread, ORBit2's I/O thread, is reading. */
static _Thread_local int reading_fd = -1;
/* The request whose call has the slot; NULL: none, or it is over. */
static void* _Atomic holders[CORBOT_PLACES];
static corbot_robot* served_robot;

static const char kDescriptor[] = "corbot-descriptor";

/* Reports each connection once after bytes have arrived there. */
static int arrived = -1;

/* Returns the library's own function of that name. */
static void* own(const char* function) {
  void* found = dlsym(RTLD_NEXT, function);
  if (found == NULL) g_error("this ORBit2 has no %s", function);
  return found;
}

void requests_serve(const char* name, GByteArray* const targets[kTargets], corbot_robot* robot) {
  served_name = g_strdup(name);
  served_robot = robot;
  arrived = epoll_create1(EPOLL_CLOEXEC);
  if (arrived < 0) g_error("epoll_create1: %s", g_strerror(errno));
  for (int i = 0; i < kTargets; ++i) keys[i] = g_byte_array_ref(targets[i]);
}

void requests_leave(int place) {
  if (atomic_exchange(&holders[place], NULL) != NULL) corbot_place_free(place);
}

static int descriptor_of(void* connection) {
  return GPOINTER_TO_INT(g_object_get_data(G_OBJECT(connection), kDescriptor)) - 1;
}

static void watch(int operation, void* connection) {
  struct epoll_event event = {.events = EPOLLIN | EPOLLET, .data.ptr = connection};
  const int fd = descriptor_of(connection);
  if (epoll_ctl(arrived, operation, fd, &event) != 0 && operation == EPOLL_CTL_ADD)
    (void)shutdown(fd, SHUT_RDWR);
}

void link_connection_from_fd(void* connection, int fd, const void* protocol, char* host, char* service,
                             gboolean initiated, int status, int options) {
  static void (*real)(void*, int, const void*, char*, char*, gboolean, int, int);
  if (real == NULL) *(void**)&real = own("link_connection_from_fd");
  g_object_set_data(G_OBJECT(connection), kDescriptor, GINT_TO_POINTER(fd + 1));
  real(connection, fd, protocol, host, service, initiated, status, options);
  if (!initiated) watch(EPOLL_CTL_ADD, connection); /* until the descriptor is closed */
}

/* Reads at most one message. */
static gboolean read_message(void* connection) {
  static gboolean (*real)(void*);
  if (real == NULL) *(void**)&real = own("giop_connection_handle_input");
  const int before = reading_fd;
  reading_fd = descriptor_of(connection);
  const gboolean result = real(connection);
  reading_fd = before;
  return result;
}

/* Returns true if a Stop may be among the first bytes of a connection: the name behind the length of Stop or
 * StopAndHold. If the answer is wrong, connections are read in another order. If a Stop lies further back,
 * requests behind it count as earlier than that Stop, so they may end with Stopped. */
static bool may_hold_stop(int fd) {
  static const char name[] = "Stop";
  static const uint32_t lengths[] = {sizeof("Stop"), sizeof("StopAndHold")};
  char bytes[2048];
  const ssize_t size = recvfrom(fd, bytes, sizeof(bytes), MSG_PEEK | MSG_DONTWAIT, NULL, NULL);
  const char* const end = bytes + (size > 0 ? size : 0);
  const char* at = bytes;
  while ((at = memmem(at, (size_t)(end - at), name, strlen(name))) != NULL) {
    uint32_t length = 0;
    if (at - bytes >= (ptrdiff_t)sizeof(length)) memcpy(&length, at - sizeof(length), sizeof(length));
    for (size_t i = 0; i < G_N_ELEMENTS(lengths); ++i)
      if (length == lengths[i] || length == GUINT32_SWAP_LE_BE(lengths[i])) return true;
    at += strlen(name);
  }
  return false;
}

/* Reads one message each of connections on which a Stop has arrived. ORBit2's I/O thread reads one message of
 * each of its connections in turn, and beside many others a Stop would wait for milliseconds. Requests that
 * have arrived on other connections count as earlier than the Stops. So all are looked at before a Stop is
 * read, in the order of their arrival, up to the fifth Stop. Otherwise a few looks are enough, so that a
 * flood leaves time to read. ORBit2 frees a connection only in this thread, after the end of its descriptor.
 */
static void read_stops_first(void) {
  enum { kLooks = 4, kLooksBeforeStop = 2 * CORBOT_MOST_CONNECTIONS, kMostStops = 4 };
  void* connections[kMostStops];
  int count = 0;
  struct epoll_event event;
  const uint64_t now = corbot_arrivals_now();
  for (int i = 0; i < (count > 0 ? kLooksBeforeStop : kLooks) && epoll_wait(arrived, &event, 1, 0) == 1;
       ++i) {
    const int fd = descriptor_of(event.data.ptr);
    if (!may_hold_stop(fd)) {
      corbot_arrivals_number(fd, now);
      continue;
    }
    if (count == kMostStops) {
      watch(EPOLL_CTL_MOD, event.data.ptr); /* reports it again at the next call */
      break;
    }
    connections[count++] = link_connection_ref(event.data.ptr);
  }
  for (int i = 0; i < count; ++i) {
    (void)read_message(connections[i]);
    if (may_hold_stop(descriptor_of(connections[i]))) watch(EPOLL_CTL_MOD, connections[i]);
    link_connection_unref(connections[i]);
  }
}

gboolean giop_connection_handle_input(void* connection) {
  read_stops_first();
  return read_message(connection);
}

/* Returns true if an object key is ours: the robot's name, or NAME/KEY of an Acquire's reference, valid or
 * not. *pass and *pass_length are then the KEY, else NULL and 0. */
static gboolean is_served(const CORBA_sequence_CORBA_octet* key, const void** pass, size_t* pass_length) {
  *pass = NULL;
  *pass_length = 0;
  if (key == NULL || served_name == NULL) return FALSE;
  const size_t length = strlen(served_name);
  if (key->_length < length || memcmp(key->_buffer, served_name, length) != 0) return FALSE;
  if (key->_length == length) return TRUE;
  if (key->_buffer[length] != '/') return FALSE;
  *pass = key->_buffer + length + 1;
  *pass_length = key->_length - length - 1;
  return TRUE;
}

/* Counts a Stop before the first lock of its request. Takes no lock, no memory and no system call itself. */
static corbot_counted_stop count_stop(void* request) {
  const corbot_counted_stop none = {0, 0, 0, 0};
  bool hold = false;
  const char* operation = giop_recv_buffer_get_opname(request);
  if (operation == NULL || served_robot == NULL || !corbot_is_stop(operation, &hold)) return none;
  return corbot_robot_count_stop(served_robot, hold ? 1 : 0);
}

/* Returns the object to which the request goes. */
static int target_of(void* request, const Call* call) {
  corbot_place_kind kind = CORBOT_PLACE_TO_WAIT;
  const char* operation = giop_recv_buffer_get_opname(request);
  if (operation == NULL || !corbot_place_needed(operation, &kind)) return kTargetAtOnce;
  int capacity = 0;
  const int place = corbot_place_take(kind, call->connection, &capacity);
  if (place >= 0) {
    atomic_store(&holders[place], request);
    return place;
  }
  switch (kind) {
    case CORBOT_PLACE_TO_START:
      return kTargetRefuseStart;
    case CORBOT_PLACE_TO_CHANGE:
      return kTargetRefuseChange;
    case CORBOT_PLACE_TO_STOP: {
      Caller room;
      corbot_robot_request_stop(served_robot, caller_of_call(call, &room),
                                strcmp(operation, "StopAndHold") == 0);
      return kTargetJoinStop;
    }
    case CORBOT_PLACE_TO_WAIT:
      break;
  }
  return capacity == CORBOT_HOST_PLACES ? kTargetRefuseHost : kTargetRefuseWait;
}

/* Sets the key, which the request does not own: it is part of the message. */
static void set_key(CORBA_sequence_CORBA_octet* key, int target) {
  key->_buffer = keys[target]->data;
  key->_length = key->_maximum = keys[target]->len;
}

void ORBit_handle_request(CORBA_ORB orb, void* request) {
  static void (*real)(CORBA_ORB, void*);
  if (real == NULL) *(void**)&real = own("ORBit_handle_request");
  if (corbot_connections_ended()) {
    giop_recv_buffer_unuse(request);
    return;
  }
  CORBA_sequence_CORBA_octet* key = giop_recv_buffer_get_objkey(request);
  const void* pass = NULL;
  size_t pass_length = 0;
  if (is_served(key, &pass, &pass_length)) {
    const corbot_counted_stop counted = count_stop(request);
    const Call call = calls_begin(request, counted, corbot_connection_used(reading_fd), pass, pass_length);
    set_key(key, target_of(request, &call));
  }
  real(orb, request);
}

void ORBit_handle_locate_request(CORBA_ORB orb, void* request) {
  static void (*real)(CORBA_ORB, void*);
  if (real == NULL) *(void**)&real = own("ORBit_handle_locate_request");
  CORBA_sequence_CORBA_octet* key = giop_recv_buffer_get_objkey(request);
  const void* pass = NULL;
  size_t pass_length = 0;
  if (is_served(key, &pass, &pass_length)) set_key(key, kTargetAtOnce);
  real(orb, request);
}

static void non_existent(PortableServer_Servant servant, gpointer result, gpointer* arguments,
                         gpointer context, CORBA_Environment* ev, gpointer implementation) {
  (void)servant;
  (void)arguments;
  (void)context;
  (void)ev;
  (void)implementation;
  *(CORBA_boolean*)result = CORBA_FALSE;
}

/* Adds the operations of every object. ORBit2 has only _is_a, and answers BAD_OPERATION to _non_existent. */
/* NOLINTNEXTLINE(readability-identifier-naming): ORBit2's name */
Skeleton get_small_skel_CORBA_Object(PortableServer_Servant servant, const char* operation, gpointer* method,
                                     gpointer* implementation) {
  static ORBit_IMethod non_existent_method = {
      {0, 0, NULL, FALSE},          {0, 0, NULL, FALSE},         {0, 0, NULL, FALSE},      TC_CORBA_boolean,
      (CORBA_char*)"_non_existent", sizeof("_non_existent") - 1, ORBit_I_COMMON_FIXED_SIZE};
  static Skeleton (*real)(PortableServer_Servant, const char*, gpointer*, gpointer*);
  if (strcmp(operation, "_non_existent") == 0 || strcmp(operation, "_not_existent") == 0) {
    *method = *implementation = &non_existent_method;
    return non_existent;
  }
  if (real == NULL) *(void**)&real = own("get_small_skel_CORBA_Object");
  return real(servant, operation, method, implementation);
}

/* Handles the end of every message. A request that never reached its operation, because its arguments were
 * unreadable, frees its slot here. */
void giop_recv_buffer_unuse(void* request) {
  static void (*real)(void*);
  if (real == NULL) *(void**)&real = own("giop_recv_buffer_unuse");
  for (int place = 0; request != NULL && place < CORBOT_PLACES; ++place) {
    void* held = request;
    if (atomic_compare_exchange_strong(&holders[place], &held, NULL)) corbot_place_free(place);
  }
  if (request != NULL) calls_end(request);
  real(request);
}
