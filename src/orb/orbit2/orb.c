/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/orb.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "net/connections.h"
#include "net/giop_probe.h"
#include "orb/orbit2/ior.h"
#include "orb/orbit2/log.h"

/* Registers the type of connections. ORBit2 exports it without a public declaration. It registers the type at
 * the first connection without a lock, and crashes if a client connects during the first outgoing call. */
extern GType giop_connection_get_type(void);

bool orb_succeeded(CORBA_Environment* ev, const char* what) {
  if (ev->_major == CORBA_NO_EXCEPTION) return true;
  log_error("%s: %s", what, CORBA_exception_id(ev));
  CORBA_exception_free(ev);
  return false;
}

static bool is_listening_at(const char* path) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  g_strlcpy(address.sun_path, path, sizeof(address.sun_path));
  const bool listens = fd >= 0 && connect(fd, (const struct sockaddr*)&address, sizeof(address)) == 0;
  if (fd >= 0) close(fd);
  return listens;
}

/* Returns true if the address is free: ORBit2 fails silently if it cannot bind. */
static bool address_is_free(const Options* options) {
  if (options->unix_path != NULL) {
    if (is_listening_at(options->unix_path)) {
      log_error("%s is in use by another program", options->unix_path);
      return false;
    }
    if (unlink(options->unix_path) == 0 || errno == ENOENT) return true; /* left by a dead process */
    log_error("%s: %s", options->unix_path, strerror(errno));
    return false;
  }
  char why[CORBOT_WHY];
  int port = 0;
  const int fd = corbot_listen(options->endpoint.host, options->endpoint.port, &port, why);
  if (fd < 0) {
    log_error("%s; --endpoint HOST:PORT chooses", why);
    return false;
  }
  close(fd);
  return true;
}

static bool listens(const Options* options) {
  if (options->unix_path != NULL) return is_listening_at(options->unix_path);
  const int fd = corbot_listening_socket(options->endpoint.host, options->endpoint.port);
  /* ORBit2 lets ten connections wait to be accepted; the kernel delays the eleventh by a second. */
  return fd >= 0 && listen(fd, SOMAXCONN) == 0;
}

static void init_orb(Orb* orb, const Options* options, CORBA_Environment* ev) {
  char host[CORBOT_HOST + 32];
  char port[sizeof(struct sockaddr_un) + 32];
  const bool tcp = options->unix_path == NULL;
  const bool ipv6 = tcp && corbot_is_ipv6(options->endpoint.host);
  char socket_number[16];
  (void)snprintf(socket_number, sizeof(socket_number), "%d", options->endpoint.port);
  (void)snprintf(host, sizeof(host), "--ORBIIOPIPName=%s", tcp ? options->endpoint.host : "localhost");
  (void)snprintf(port, sizeof(port), "--ORBIIOPIPSock=%s", tcp ? socket_number : options->unix_path);
  /* The files ~/.orbitrc and /etc/orbitrc could open other addresses. The options that forbid them work only
   * if a word follows that is no option. ORBit2's time-outs, 60 s by default, apply to a server's
   * connections, too. They use a thread that may have ended meanwhile, which crashes; so they are off. */
  const char* own[] = {"corbot-servant-orbit2",
                       "--ORBNoUserRC",
                       "yes",
                       "--ORBNoSystemRC",
                       "yes",
                       tcp && !ipv6 ? "--ORBIIOPIPv4=1" : "--ORBIIOPIPv4=0",
                       ipv6 ? "--ORBIIOPIPv6=1" : "--ORBIIOPIPv6=0",
                       tcp ? "--ORBIIOPUSock=0" : "--ORBIIOPUSock=1",
                       host,
                       port,
                       "--GIOPTimeoutMSEC=0"};
  char* words[G_N_ELEMENTS(own) + kMostOrbOptions + 1] = {NULL};
  int count = 0;
  for (size_t i = 0; i < G_N_ELEMENTS(own); ++i) words[count++] = (char*)own[i];
  for (int i = 0; i < options->orb_count; ++i) words[count++] = (char*)options->orb[i];
  orb->orb = CORBA_ORB_init(&count, words, (char*)"orbit-local-orb", ev);
}

/* Starts the ORB with a private directory. At its start ORBit2 looks for a private directory for sockets,
 * whatever it listens on, and leaves one under /tmp if it finds none. */
static bool init_orb_in_private(Orb* orb, const Options* options, CORBA_Environment* ev) {
  GError* error = NULL;
  char* directory = g_dir_make_tmp("corbot-orbit2-XXXXXX", &error);
  if (directory == NULL) {
    log_error("%s", error->message);
    g_error_free(error);
    return false;
  }
  g_setenv("ORBIT_SOCKETDIR", directory, TRUE);
  init_orb(orb, options, ev);
  (void)giop_connection_get_type();
  (void)rmdir(directory);
  g_free(directory);
  return orb_succeeded(ev, "ORBit2 does not start");
}

/* Creates a POA beside the root, which always has one thread. */
static PortableServer_POA new_poa(Orb* orb, const char* name, ORBitThreadHint threads,
                                  CORBA_Environment* ev) {
  PortableServer_POAManager manager = PortableServer_POA__get_the_POAManager(orb->root, ev);
  CORBA_Policy policy =
      (CORBA_Policy)PortableServer_POA_create_thread_policy(orb->root, PortableServer_ORB_CTRL_MODEL, ev);
  CORBA_PolicyList policies = {1, 1, &policy, CORBA_FALSE};
  PortableServer_POA poa = PortableServer_POA_create_POA(orb->root, (char*)name, manager, &policies, ev);
  if (ev->_major == CORBA_NO_EXCEPTION)
    ORBit_ObjectAdaptor_set_thread_hint((ORBit_ObjectAdaptor)poa, threads);
  CORBA_Policy_destroy(policy, ev);
  CORBA_Object_release((CORBA_Object)policy, ev);
  CORBA_Object_release((CORBA_Object)manager, ev);
  return poa;
}

static void create_poas(Orb* orb, CORBA_Environment* ev) {
  orb->root = (PortableServer_POA)CORBA_ORB_resolve_initial_references(orb->orb, (char*)"RootPOA", ev);
  if (ev->_major != CORBA_NO_EXCEPTION) return;
  /* Not a thread for each connection: JacORB and ORBit2 clients put all their calls on one connection. A Stop
   * would then wait for the Move that it is to end (docs/orbs.md has the measurement). */
  orb->poa = new_poa(orb, "robots", ORBIT_THREAD_HINT_PER_REQUEST, ev);
  if (ev->_major != CORBA_NO_EXCEPTION) return;
  orb->refusing = new_poa(orb, "refusing", ORBIT_THREAD_HINT_PER_POA, ev);
  if (ev->_major != CORBA_NO_EXCEPTION) return;
  orb->joining = new_poa(orb, "joining", ORBIT_THREAD_HINT_PER_POA, ev);
}

bool orb_start(Orb* orb, const Options* options) {
  memset(orb, 0, sizeof(*orb));
  if (!address_is_free(options)) return false;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (!init_orb_in_private(orb, options, &ev)) return false;
  create_poas(orb, &ev);
  return orb_succeeded(&ev, "no POA");
}

/* Checks like a client that the robot is served. An ORBit2 that was linked in another way may not call
 * requests.c, and would serve nothing. */
static bool is_served(const Options* options, const char* name) {
  static const int patience_ms = 10000;
  corbot_giop_probe probe;
  corbot_giop_probe_init(&probe, options->endpoint.host, options->endpoint.port, options->unix_path, name);
  const bool good = corbot_giop_probe_answers(&probe, patience_ms) && probe.is_here;
  corbot_giop_probe_close(&probe);
  if (!good) log_error("ORBit2 does not serve the key '%s': is it linked with -Bsymbolic?", name);
  return good;
}

static PortableServer_POA poa_for(const Orb* orb, int target) {
  if (target < CORBOT_PLACES || target == kTargetAtOnce) return orb->poa;
  return target == kTargetJoinStop ? orb->joining : orb->refusing;
}

/* Activates one servant. Returns the key of its object, or NULL on failure. */
static GByteArray* activate(Orb* orb, ArmServant* servant, CORBA_Environment* ev) {
  PortableServer_POA poa = poa_for(orb, servant->target);
  PortableServer_ObjectId* id = PortableServer_POA_activate_object(poa, servant, ev);
  if (!orb_succeeded(ev, "the servant cannot be activated")) return NULL;
  CORBA_Object object = PortableServer_POA_servant_to_reference(poa, servant, ev);
  if (!orb_succeeded(ev, "the servant has no reference")) return NULL;
  char* ior = CORBA_ORB_object_to_string(orb->orb, object, ev); /* ORBit2 begins to listen in this call */
  if (!orb_succeeded(ev, "the servant has no address")) return NULL;
  GByteArray* key = ior_key(ior, id->_buffer, id->_length);
  if (key == NULL) log_error("no object key in %s", ior);
  CORBA_free(ior);
  CORBA_free(id);
  CORBA_Object_release(object, ev);
  return key;
}

static bool activate_all(Orb* orb, ArmServant servants[kTargets], const char* name, CORBA_Environment* ev) {
  GByteArray* keys[kTargets] = {NULL};
  bool good = true;
  for (int i = 0; i < kTargets && good; ++i) {
    keys[i] = activate(orb, &servants[i], ev);
    good = keys[i] != NULL;
  }
  if (good) requests_serve(name, keys, servants[0].robot);
  for (int i = 0; i < kTargets; ++i) {
    if (keys[i] != NULL) g_byte_array_unref(keys[i]);
  }
  return good;
}

bool orb_serve(Orb* orb, const Options* options, ArmServant servants[kTargets], const char* name) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  const mode_t mask = umask(S_IXUSR | S_IRWXG | S_IRWXO); /* mode of the Unix socket: its owner only */
  const bool active = activate_all(orb, servants, name, &ev);
  (void)umask(mask);
  if (!active) return false;
  PortableServer_POAManager manager = PortableServer_POA__get_the_POAManager(orb->root, &ev);
  PortableServer_POAManager_activate(manager, &ev);
  CORBA_Object_release((CORBA_Object)manager, &ev);
  if (!orb_succeeded(&ev, "the POA cannot be activated")) return false;
  corbot_connections_serve();
  if (listens(options)) return is_served(options, name);
  char* reference = orb_reference(options, name);
  log_error("ORBit2 does not listen at %s: has another program just taken the address?", reference);
  g_free(reference);
  return false;
}

char* orb_reference(const Options* options, const char* name) {
  if (options->unix_path != NULL) return g_strdup_printf("corbaloc:uiop:%s:/%s", options->unix_path, name);
  char address[CORBOT_HOST + 16];
  corbot_endpoint_text(options->endpoint.host, options->endpoint.port, address, sizeof(address));
  return g_strdup_printf("corbaloc::%s/%s", address, name);
}

void orb_end(Orb* orb) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (orb->orb != NULL) {
    CORBA_Object_release((CORBA_Object)orb->joining, &ev);
    CORBA_Object_release((CORBA_Object)orb->refusing, &ev);
    CORBA_Object_release((CORBA_Object)orb->poa, &ev);
    CORBA_Object_release((CORBA_Object)orb->root, &ev);
    CORBA_ORB_destroy(orb->orb, &ev);
    CORBA_Object_release((CORBA_Object)orb->orb, &ev);
  }
  CORBA_exception_free(&ev);
}
