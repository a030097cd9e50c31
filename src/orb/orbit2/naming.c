/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/naming.h"

#include <ORBitservices/CosNaming.h>
#include <glib.h>
#include <stdbool.h>
#include <string.h>

#include "orb/orbit2/ior.h"
#include "orb/orbit2/log.h"

static const gint64 kPollPeriod_us = 1000000;
/* A service that hangs must not delay the servant's end; a supervisor waits five seconds. */
static const gint64 kEndTimeout_us = 2000000;

struct NameBinder {
  CORBA_ORB orb;
  const char* service; /* as given, for the log */
  char* robot;
  char* service_ior;
  char* robot_ior;
  CosNaming_NameComponent components[2];
  CORBA_Object root; /* reference to the service; nil before the first use and after a failure */
  CORBA_Object ours;
  bool bound;
  bool has_warned;

  GMutex mutex;
  GCond changed;
  bool end;
  bool ended;
  GThread* thread;
};

static CosNaming_Name name_of(NameBinder* binder, CORBA_unsigned_long length) {
  const CosNaming_Name name = {length, length, binder->components, CORBA_FALSE};
  return name;
}

static bool raised(const CORBA_Environment* ev) { return ev->_major != CORBA_NO_EXCEPTION; }

static bool raised_user(CORBA_Environment* ev, const char* id) {
  return ev->_major == CORBA_USER_EXCEPTION && g_strcmp0(CORBA_exception_id(ev), id) == 0;
}

/* Creates references anew after a failure, as the old ones may lead to a service that has ended. It does so
 * only then: ORBit2 leaks some fifty bytes of every corbaloc that it reads. */
static bool has_references(NameBinder* binder, CORBA_Environment* ev) {
  if (binder->root == CORBA_OBJECT_NIL) {
    binder->root = CORBA_ORB_string_to_object(binder->orb, binder->service_ior, ev);
  }
  if (!raised(ev) && binder->ours == CORBA_OBJECT_NIL) {
    binder->ours = CORBA_ORB_string_to_object(binder->orb, binder->robot_ior, ev);
  }
  if (raised(ev)) return false;
  if (binder->root != CORBA_OBJECT_NIL && binder->ours != CORBA_OBJECT_NIL) return true;
  CORBA_exception_set_system(ev, ex_CORBA_INV_OBJREF, CORBA_COMPLETED_NO);
  return false;
}

static void drop_references(NameBinder* binder) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  CORBA_Object_release(binder->ours, &ev);
  CORBA_Object_release(binder->root, &ev);
  CORBA_exception_free(&ev);
  binder->ours = CORBA_OBJECT_NIL;
  binder->root = CORBA_OBJECT_NIL;
}

static bool is_ours(NameBinder* binder, CORBA_Environment* ev) {
  const CosNaming_Name name = name_of(binder, 2);
  CORBA_Object found = CosNaming_NamingContext_resolve(binder->root, &name, ev);
  if (raised_user(ev, ex_CosNaming_NamingContext_NotFound)) {
    CORBA_exception_free(ev);
    return false;
  }
  if (raised(ev)) return false;
  const bool equivalent = CORBA_Object_is_equivalent(found, binder->ours, ev) != CORBA_FALSE;
  CORBA_Object_release(found, ev);
  return equivalent;
}

static void bind(NameBinder* binder, CORBA_Environment* ev) {
  const CosNaming_Name context = name_of(binder, 1);
  const CosNaming_Name name = name_of(binder, 2);
  CosNaming_NamingContext created = CosNaming_NamingContext_bind_new_context(binder->root, &context, ev);
  if (raised_user(ev, ex_CosNaming_NamingContext_AlreadyBound)) {
    CORBA_exception_free(ev); /* usual: another robot, or an earlier process of this one, created it */
  } else if (raised(ev)) {
    return;
  } else {
    CORBA_Object_release(created, ev);
  }
  CosNaming_NamingContext_rebind(binder->root, &name, binder->ours, ev);
  if (raised(ev)) return;
  log_info("%s as Robots/%s.Robot in %s", binder->bound ? "named again" : "named", binder->robot,
           binder->service);
  binder->has_warned = false;
}

static void keep_bound(NameBinder* binder) {
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (has_references(binder, &ev) && !is_ours(binder, &ev) && !raised(&ev)) bind(binder, &ev);
  if (!raised(&ev)) {
    binder->bound = true;
    return;
  }
  if (!binder->has_warned) {
    log_warning("naming service %s: %s; going on without it and trying again", binder->service,
                CORBA_exception_id(&ev));
  }
  binder->has_warned = true;
  CORBA_exception_free(&ev);
  drop_references(binder);
}

static void unbind(NameBinder* binder) {
  if (!binder->bound) return;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  if (has_references(binder, &ev) && is_ours(binder, &ev)) {
    const CosNaming_Name name = name_of(binder, 2);
    CosNaming_NamingContext_unbind(binder->root, &name, &ev);
  }
  if (!raised(&ev)) return;
  log_warning("naming service %s: %s; Robots/%s.Robot stays bound", binder->service, CORBA_exception_id(&ev),
              binder->robot);
  CORBA_exception_free(&ev);
}

static gpointer run(gpointer data) {
  NameBinder* binder = data;
  g_mutex_lock(&binder->mutex);
  while (!binder->end) {
    g_mutex_unlock(&binder->mutex);
    keep_bound(binder);
    g_mutex_lock(&binder->mutex);
    const gint64 until = g_get_monotonic_time() + kPollPeriod_us;
    while (!binder->end && g_cond_wait_until(&binder->changed, &binder->mutex, until)) continue;
  }
  g_mutex_unlock(&binder->mutex);
  unbind(binder);
  drop_references(binder);
  g_mutex_lock(&binder->mutex);
  binder->ended = true;
  g_cond_signal(&binder->changed);
  g_mutex_unlock(&binder->mutex);
  return NULL;
}

NameBinder* name_binder_start(CORBA_ORB orb, const Options* options, const char* robot) {
  NameBinder* binder = g_new0(NameBinder, 1);
  binder->orb = orb;
  binder->service = options->naming;
  binder->robot = g_strdup(robot);
  binder->service_ior = ior_from_reference("IDL:omg.org/CosNaming/NamingContext:1.0", options->naming);
  binder->robot_ior = ior_make("IDL:Corbot/Arm:1.0", options->endpoint.host, options->endpoint.port, robot,
                               (unsigned)strlen(robot));
  binder->components[0].id = (char*)"Robots";
  binder->components[0].kind = (char*)"";
  binder->components[1].id = binder->robot;
  binder->components[1].kind = (char*)"Robot";
  g_mutex_init(&binder->mutex);
  g_cond_init(&binder->changed);
  binder->thread = g_thread_new("naming", run, binder);
  return binder;
}

void name_binder_end(NameBinder* binder) {
  if (binder == NULL) return;
  g_mutex_lock(&binder->mutex);
  binder->end = true;
  g_cond_signal(&binder->changed);
  const gint64 until = g_get_monotonic_time() + kEndTimeout_us;
  while (!binder->ended && g_cond_wait_until(&binder->changed, &binder->mutex, until)) continue;
  const bool ended = binder->ended;
  g_mutex_unlock(&binder->mutex);
  if (!ended) { /* the thread waits for a reply, and uses the members below, until the process ends */
    log_warning("naming service %s does not reply; Robots/%s.Robot stays bound", binder->service,
                binder->robot);
    return;
  }
  g_thread_join(binder->thread);
  g_cond_clear(&binder->changed);
  g_mutex_clear(&binder->mutex);
  g_free(binder->robot);
  g_free(binder->service_ior);
  g_free(binder->robot_ior);
  g_free(binder);
}
