/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/naming.h"

#include <ORBitservices/CosNaming.h>
#include <glib.h>
#include <stdbool.h>
#include <string.h>

#include "orb/orbit2/ior.h"
#include "orb/orbit2/log.h"

static const gint64 kBetweenLooks_us = 1000000;
/* A service that hangs must not hold the servant up when it ends; a supervisor waits five seconds. */
static const gint64 kPatienceAtTheEnd_us = 2000000;

struct NameKeeper {
  CORBA_ORB orb;
  const char* service; /* as it was given, for the log */
  char* robot;
  char* service_ior;
  char* robot_ior;
  CosNaming_NameComponent components[2];
  CORBA_Object root; /* of the service; nil before the first use and after a failure */
  CORBA_Object ours;
  bool bound;
  bool complained;

  GMutex mutex;
  GCond changed;
  bool end;
  bool ended;
  GThread* thread;
};

static CosNaming_Name name_of(NameKeeper* keeper, CORBA_unsigned_long length) {
  const CosNaming_Name name = {length, length, keeper->components, CORBA_FALSE};
  return name;
}

static bool raised(const CORBA_Environment* ev) { return ev->_major != CORBA_NO_EXCEPTION; }

static bool raised_user(CORBA_Environment* ev, const char* id) {
  return ev->_major == CORBA_USER_EXCEPTION && g_strcmp0(CORBA_exception_id(ev), id) == 0;
}

/* References are made anew after a failure, for the old ones may lead to a service that is no more, and only
 * then: ORBit2 leaks some fifty bytes of every corbaloc that it reads. */
static bool has_references(NameKeeper* keeper, CORBA_Environment* ev) {
  if (keeper->root == CORBA_OBJECT_NIL) {
    keeper->root = CORBA_ORB_string_to_object(keeper->orb, keeper->service_ior, ev);
  }
  if (!raised(ev) && keeper->ours == CORBA_OBJECT_NIL) {
    keeper->ours = CORBA_ORB_string_to_object(keeper->orb, keeper->robot_ior, ev);
  }
  if (raised(ev)) return false;
  if (keeper->root != CORBA_OBJECT_NIL && keeper->ours != CORBA_OBJECT_NIL) return true;
  CORBA_exception_set_system(ev, ex_CORBA_INV_OBJREF, CORBA_COMPLETED_NO);
  return false;
}

static void drop_references(NameKeeper* keeper) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  CORBA_Object_release(keeper->ours, &ev);
  CORBA_Object_release(keeper->root, &ev);
  CORBA_exception_free(&ev);
  keeper->ours = CORBA_OBJECT_NIL;
  keeper->root = CORBA_OBJECT_NIL;
}

static bool is_ours(NameKeeper* keeper, CORBA_Environment* ev) {
  const CosNaming_Name name = name_of(keeper, 2);
  CORBA_Object found = CosNaming_NamingContext_resolve(keeper->root, &name, ev);
  if (raised_user(ev, ex_CosNaming_NamingContext_NotFound)) {
    CORBA_exception_free(ev);
    return false;
  }
  if (raised(ev)) return false;
  const bool ours_it_is = CORBA_Object_is_equivalent(found, keeper->ours, ev) != CORBA_FALSE;
  CORBA_Object_release(found, ev);
  return ours_it_is;
}

static void bind(NameKeeper* keeper, CORBA_Environment* ev) {
  const CosNaming_Name context = name_of(keeper, 1);
  const CosNaming_Name name = name_of(keeper, 2);
  CosNaming_NamingContext created = CosNaming_NamingContext_bind_new_context(keeper->root, &context, ev);
  if (raised_user(ev, ex_CosNaming_NamingContext_AlreadyBound)) {
    CORBA_exception_free(ev); /* the usual case: another robot, or an earlier life of this one, made it */
  } else if (raised(ev)) {
    return;
  } else {
    CORBA_Object_release(created, ev);
  }
  CosNaming_NamingContext_rebind(keeper->root, &name, keeper->ours, ev);
  if (raised(ev)) return;
  log_info("%s as Robots/%s.Robot in %s", keeper->bound ? "named again" : "named", keeper->robot,
           keeper->service);
  keeper->complained = false;
}

static void keep_bound(NameKeeper* keeper) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (has_references(keeper, &ev) && !is_ours(keeper, &ev) && !raised(&ev)) bind(keeper, &ev);
  if (!raised(&ev)) {
    keeper->bound = true;
    return;
  }
  if (!keeper->complained) {
    log_warning("naming service %s: %s; going on without it and trying again", keeper->service,
                CORBA_exception_id(&ev));
  }
  keeper->complained = true;
  CORBA_exception_free(&ev);
  drop_references(keeper);
}

static void unbind(NameKeeper* keeper) {
  if (!keeper->bound) return;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (has_references(keeper, &ev) && is_ours(keeper, &ev)) {
    const CosNaming_Name name = name_of(keeper, 2);
    CosNaming_NamingContext_unbind(keeper->root, &name, &ev);
  }
  if (!raised(&ev)) return;
  log_warning("naming service %s: %s; Robots/%s.Robot stays bound", keeper->service, CORBA_exception_id(&ev),
              keeper->robot);
  CORBA_exception_free(&ev);
}

static gpointer run(gpointer data) {
  NameKeeper* keeper = data;
  g_mutex_lock(&keeper->mutex);
  while (!keeper->end) {
    g_mutex_unlock(&keeper->mutex);
    keep_bound(keeper);
    g_mutex_lock(&keeper->mutex);
    const gint64 until = g_get_monotonic_time() + kBetweenLooks_us;
    while (!keeper->end && g_cond_wait_until(&keeper->changed, &keeper->mutex, until)) continue;
  }
  g_mutex_unlock(&keeper->mutex);
  unbind(keeper);
  drop_references(keeper);
  g_mutex_lock(&keeper->mutex);
  keeper->ended = true;
  g_cond_signal(&keeper->changed);
  g_mutex_unlock(&keeper->mutex);
  return NULL;
}

NameKeeper* name_keeper_start(CORBA_ORB orb, const Options* options, const char* robot) {
  NameKeeper* keeper = g_new0(NameKeeper, 1);
  keeper->orb = orb;
  keeper->service = options->naming;
  keeper->robot = g_strdup(robot);
  keeper->service_ior = ior_from_reference("IDL:omg.org/CosNaming/NamingContext:1.0", options->naming);
  /* Without a type, so that clients ask for it first: omniORB follows the forward of that call only. */
  keeper->robot_ior =
      ior_make("", options->endpoint.host, options->endpoint.port, robot, (unsigned)strlen(robot));
  keeper->components[0].id = (char*)"Robots";
  keeper->components[0].kind = (char*)"";
  keeper->components[1].id = keeper->robot;
  keeper->components[1].kind = (char*)"Robot";
  g_mutex_init(&keeper->mutex);
  g_cond_init(&keeper->changed);
  keeper->thread = g_thread_new("naming", run, keeper);
  return keeper;
}

void name_keeper_end(NameKeeper* keeper) {
  if (keeper == NULL) return;
  g_mutex_lock(&keeper->mutex);
  keeper->end = true;
  g_cond_signal(&keeper->changed);
  const gint64 until = g_get_monotonic_time() + kPatienceAtTheEnd_us;
  while (!keeper->ended && g_cond_wait_until(&keeper->changed, &keeper->mutex, until)) continue;
  const bool ended = keeper->ended;
  g_mutex_unlock(&keeper->mutex);
  if (!ended) { /* the thread waits for an answer, with what is below, until the process ends */
    log_warning("naming service %s does not answer; Robots/%s.Robot stays bound", keeper->service,
                keeper->robot);
    return;
  }
  g_thread_join(keeper->thread);
  g_cond_clear(&keeper->changed);
  g_mutex_clear(&keeper->mutex);
  g_free(keeper->robot);
  g_free(keeper->service_ior);
  g_free(keeper->robot_ior);
  g_free(keeper);
}
