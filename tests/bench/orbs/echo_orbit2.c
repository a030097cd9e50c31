/* SPDX-License-Identifier: Apache-2.0
 * A bare ORBit2 servant: a constant for CartCoord, nothing for Move; all else raises NO_IMPLEMENT. The ORB is
 * started by the code of corbot-servant-orbit2, so that both have the same options and threads. Serves until
 * its standard input closes.
 *   echo_orbit2 {HOST:PORT | /PATH} {request | connection}
 * The second argument says what gets a thread of its own. */
#include <arm.h>
#include <glib-unix.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "orb/orbit2/log.h"
#include "orb/orbit2/orb.h"

static Corbot_CartesianCoord get_cart_coord(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)servant;
  (void)ev;
  const Corbot_CartesianCoord here = {0.2, 0.0, 0.1, 0.0, 0.0, 0.0};
  return here;
}

static void move(PortableServer_Servant servant, CORBA_double px, CORBA_double py, CORBA_double pz,
                 CORBA_double d, CORBA_double t, CORBA_Environment* ev) {
  (void)servant;
  (void)px;
  (void)py;
  (void)pz;
  (void)d;
  (void)t;
  (void)ev;
}

static gboolean end(gint fd, GIOCondition condition, gpointer loop) {
  (void)fd;
  (void)condition;
  g_main_loop_quit(loop);
  return G_SOURCE_REMOVE;
}

static bool options_of(int argc, char** argv, Options* out) {
  memset(out, 0, sizeof(*out));
  if (argc != 3) {
    log_error("two arguments: {HOST:PORT | /PATH} {request | connection}");
    return false;
  }
  if (argv[1][0] == '/') {
    out->unix_path = argv[1];
    return true;
  }
  char why[CORBOT_WHY];
  if (corbot_endpoint_parse(argv[1], &out->endpoint, why)) return true;
  log_error("%s", why);
  return false;
}

int main(int argc, char** argv) {
  static PortableServer_ServantBase__epv base_epv;
  static POA_Corbot_Robot__epv epv = {._get_CartCoord = get_cart_coord, .Move = move};
  static POA_Corbot_Arm__epv arm_epv;
  static POA_Corbot_Arm__vepv vepv = {&base_epv, &epv, &arm_epv};
  static ArmServant servants[kTargets]; /* without a robot: nothing here stops one */
  Options options;
  if (!options_of(argc, argv, &options)) return 2;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  for (int target = 0; target < kTargets; ++target) {
    servants[target].base.vepv = &vepv;
    servants[target].target = target;
    POA_Corbot_Arm__init(&servants[target].base, &ev);
  }
  Orb orb;
  bool serves = orb_succeeded(&ev, "no servant") && orb_start(&orb, &options);
  if (serves && strcmp(argv[2], "connection") == 0) {
    ORBit_ObjectAdaptor_set_thread_hint((ORBit_ObjectAdaptor)orb.poa, ORBIT_THREAD_HINT_PER_CONNECTION);
  }
  serves = serves && orb_serve(&orb, &options, servants, "echo");
  if (!serves) return 1;
  GMainLoop* loop = g_main_loop_new(NULL, FALSE);
  g_unix_fd_add(STDIN_FILENO, G_IO_IN | G_IO_HUP, end, loop);
  char* reference = orb_reference(&options, "echo");
  (void)printf("ready %s\n", reference);
  (void)fflush(stdout);
  g_free(reference);
  g_main_loop_run(loop);
  g_main_loop_unref(loop);
  orb_end(&orb);
  return 0;
}
