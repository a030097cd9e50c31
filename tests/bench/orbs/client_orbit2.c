/* SPDX-License-Identifier: Apache-2.0
 * An ORBit2 client that measures on command, so that others can be measured in between:
 *   client_orbit2 REFERENCE
 * A line "read N" or "move N" on standard input makes N calls, one after another, and prints the time of
 * each, ns, in one line. Ends with its input. */
#include <arm.h>
#include <glib.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { kMostCalls = 100000 };

typedef struct Client {
  CORBA_ORB orb;
  Corbot_Robot robot;
  Corbot_CartesianCoord here;
} Client;

static bool went_well(CORBA_Environment* ev, const char* what) {
  if (ev->_major == CORBA_NO_EXCEPTION) return true;
  (void)fprintf(stderr, "client on ORBit2: %s: %s\n", what, CORBA_exception_id(ev));
  CORBA_exception_free(ev);
  return false;
}

static void read_position(Client* client, CORBA_Environment* ev) {
  client->here = Corbot_Robot__get_CartCoord(client->robot, ev);
}

static void move(Client* client, CORBA_Environment* ev) {
  Corbot_Robot_Move(client->robot, client->here.x, client->here.y, client->here.z, 0.0, 0.0, ev);
}

static bool start(Client* client, const char* reference, CORBA_Environment* ev) {
  /* ORBit2's defaults, whatever ~/.orbitrc and /etc/orbitrc say. The transport is the reference's: a server
   * on a Unix socket names nothing else in the references that it forwards to. */
  char* words[] = {(char*)"client_orbit2",   (char*)"--ORBNoUserRC", (char*)"yes",
                   (char*)"--ORBNoSystemRC", (char*)"yes",           NULL};
  int count = (int)G_N_ELEMENTS(words) - 1;
  client->orb = CORBA_ORB_init(&count, words, (char*)"orbit-local-orb", ev);
  if (!went_well(ev, "ORBit2 does not start")) return false;
  client->robot = (Corbot_Robot)CORBA_ORB_string_to_object(client->orb, (char*)reference, ev);
  if (!went_well(ev, reference)) return false;
  read_position(client, ev);
  if (!went_well(ev, "CartCoord")) return false;
  move(client, ev);
  if (!went_well(ev, "Move")) return false;
  read_position(client, ev); /* from here on a Move leads exactly nowhere */
  return went_well(ev, "CartCoord");
}

static int64_t now_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static bool measure(Client* client, void (*call)(Client*, CORBA_Environment*), int count,
                    CORBA_Environment* ev) {
  static int64_t times_ns[kMostCalls];
  for (int i = 0; i < count; ++i) {
    const int64_t begin_ns = now_ns();
    call(client, ev);
    times_ns[i] = now_ns() - begin_ns;
    if (!went_well(ev, "call")) return false;
  }
  for (int i = 0; i < count; ++i) (void)printf("%" PRId64 "%c", times_ns[i], i + 1 < count ? ' ' : '\n');
  return fflush(stdout) == 0;
}

static bool handle_command(Client* client, CORBA_Environment* ev) {
  char line[64];
  while (fgets(line, sizeof(line), stdin) != NULL) {
    char what[8];
    int count = 0;
    if (sscanf(line, "%7s %d", what, &count) != 2 || count < 1 || count > kMostCalls) return false;
    const bool moves = strcmp(what, "move") == 0;
    if (!measure(client, moves ? move : read_position, count, ev)) return false;
  }
  return true;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    (void)fprintf(stderr, "client on ORBit2: one argument, the reference\n");
    return 2;
  }
  Client client = {0};
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  bool good = start(&client, argv[1], &ev);
  if (good) {
    (void)puts("ready");
    (void)fflush(stdout);
    good = handle_command(&client, &ev);
  }
  CORBA_Object_release(client.robot, &ev);
  if (client.orb != CORBA_OBJECT_NIL) CORBA_ORB_destroy(client.orb, &ev);
  CORBA_Object_release((CORBA_Object)client.orb, &ev);
  return good ? 0 : 1;
}
