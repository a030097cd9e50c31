/* SPDX-License-Identifier: Apache-2.0 */
#include <glib-unix.h>
#include <glib.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "corbot/standard_streams.h"
#include "net/arrivals.h"
#include "net/connections.h"
#include "net/giop_probe.h"
#include "orb/orbit2/arm_servant.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/ior.h"
#include "orb/orbit2/log.h"
#include "orb/orbit2/naming.h"
#include "orb/orbit2/options.h"
#include "orb/orbit2/orb.h"
#include "orb/orbit2/requests.h"
#include "robot/corbot_robot.h"

static const gulong kReplyWritten_us = 50000;
static const int kMostWaits = 1000;

typedef struct EndRequest {
  GMainLoop* loop;
  int signal;
} EndRequest;

static gboolean end_by_interrupt(gpointer data) {
  EndRequest* request = data;
  request->signal = SIGINT;
  g_main_loop_quit(request->loop);
  return G_SOURCE_CONTINUE;
}

static gboolean end_by_termination(gpointer data) {
  EndRequest* request = data;
  request->signal = SIGTERM;
  g_main_loop_quit(request->loop);
  return G_SOURCE_CONTINUE;
}

static gboolean end_by_hangup(gpointer data) {
  EndRequest* request = data;
  request->signal = SIGHUP;
  g_main_loop_quit(request->loop);
  return G_SOURCE_CONTINUE;
}

/* Waits until the interrupted calls are over, and briefly more. The ORB does not report when a reply has been
 * written; on an idle machine that follows within microseconds. */
static void flush_replies(void) {
  for (int i = 0; i < kMostWaits && !corbot_places_idle(); ++i) g_usleep(1000);
  g_usleep(kReplyWritten_us);
}

/* The servant's own client, which checks that a request gets through to the ORB. */
static int answers(void* probe) {
  static const int kTimeout_ms = 1000;
  return corbot_giop_probe_answers(probe, kTimeout_ms);
}

/* Serves until a signal requests the end. Uses its own main loop: CORBA_ORB_run would not serve GLib's
 * sources, which include the signals. */
static void run(const Orb* orb, const Options* options, const char* name, corbot_robot* robot) {
  EndRequest request = {g_main_loop_new(NULL, FALSE), 0};
  struct sigaction of_parent;
  const gboolean may_hang_up = sigaction(SIGHUP, NULL, &of_parent) == 0 && of_parent.sa_handler != SIG_IGN;
  const guint sources[] = {g_unix_signal_add(SIGINT, end_by_interrupt, &request),
                           g_unix_signal_add(SIGTERM, end_by_termination, &request),
                           may_hang_up ? g_unix_signal_add(SIGHUP, end_by_hangup, &request) : 0};
  (void)signal(SIGPIPE, SIG_IGN); /* the reader of the log may end */
  char* reference = orb_reference(options, name);
  NameBinder* binder = NULL;
  if (options->naming != NULL) binder = name_binder_start(orb->orb, options, name);
  if (options->unix_path == NULL) {
    char* ior = ior_make("IDL:Corbot/Arm:1.0", options->endpoint.host, options->endpoint.port, name,
                         (unsigned)strlen(name));
    log_info("for clients on ORBit2, which read a corbaloc only with 16 GiB of memory: %s", ior);
    g_free(ior);
  }
  (void)printf("ready %s\n", reference);
  (void)fflush(stdout);
  corbot_giop_probe probe;
  corbot_giop_probe_init(&probe, options->endpoint.host, options->endpoint.port, options->unix_path, name);
  corbot_robot_serve(robot, answers, &probe);
  corbot_robot_heed_release_signal(robot);
  g_main_loop_run(request.loop);
  log_info("signal %d: ending", request.signal);
  name_binder_end(binder);
  corbot_robot_interrupt(robot); /* calls that wait for motions return */
  corbot_giop_probe_close(&probe);
  flush_replies();
  corbot_connections_end();
  corbot_connections_close_listeners();
  for (int i = 0; i < kMostWaits && !calls_idle(); ++i) g_usleep(1000);
  g_usleep(kReplyWritten_us); /* a thread stays in the POA briefly after the end of its request */
  for (size_t i = 0; i < G_N_ELEMENTS(sources); ++i) {
    if (sources[i] != 0) g_source_remove(sources[i]);
  }
  g_main_loop_unref(request.loop);
  g_free(reference);
}

static void count_stops(void* robot, uint64_t* all, uint64_t* by_others) {
  corbot_robot_stops(robot, all, by_others);
}

static void warn(const char* text) { log_warning("%s", text); }

static bool serve(const Options* options, corbot_robot* robot, const char* name) {
  static ArmServant servants[kTargets]; /* outlive the ORB's threads */
  static ControlReferences references;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  for (int i = 0; i < kTargets; ++i) arm_servant_init(&servants[i], robot, &references, i, &ev);
  Orb orb;
  corbot_arrivals_start(count_stops, robot);
  bool served = orb_succeeded(&ev, "no servant") && orb_start(&orb, options);
  if (served) {
    references = (ControlReferences){orb.orb, options, name};
    served = orb_serve(&orb, options, servants, name);
  }
  if (served) run(&orb, options, name, robot);
  orb_end(&orb);
  corbot_arrivals_end();
  for (int i = 0; i < kTargets; ++i) arm_servant_fini(&servants[i], &ev);
  CORBA_exception_free(&ev);
  return served;
}

int main(int argc, char** argv) {
  Options options;
  corbot_block_release_signal(); /* before any thread starts: all of them inherit the mask */
  options_parse(argc, argv, &options);
  log_start();
  corbot_connections_start();
  bool good = false;
  corbot_error error;
  corbot_robot* robot = corbot_robot_open(options.profile, options.name, &error);
  if (robot == NULL) {
    log_error("%s", error.text);
  } else {
    corbot_robot_keep_state(robot, options.state_directory, warn);
    corbot_description description;
    corbot_robot_describe(robot, &description);
    good = options_settle_endpoint(&options, description.endpoint_host, description.endpoint_port) &&
           serve(&options, robot, description.name);
    corbot_robot_close(robot);
  }
  options_free(&options);
  return good ? 0 : 1;
}
