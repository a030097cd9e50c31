/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ORB_H
#define CORBOT_ORBIT2_ORB_H

#include <orbit/orbit.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/options.h"
#include "orb/orbit2/requests.h"

/* An ORB that listens, a POA whose objects several threads serve at once, and two that have a single thread
 * each, for calls that are refused and for Stops that wait with another's. */
typedef struct Orb {
  CORBA_ORB orb;
  PortableServer_POA root;
  PortableServer_POA poa;
  PortableServer_POA refusing;
  PortableServer_POA joining;
} Orb;

/* False, and the reason in the log, when that cannot be. */
bool orb_start(Orb* orb, const Options* options);
/* Activates the servants, one for each target, makes the robot known under the object key `name`, and begins
 * to serve. False, and the reason in the log, when it could not be reached. */
bool orb_serve(Orb* orb, const Options* options, ArmServant servants[kTargets], const char* name);
/* Where clients find the object: corbaloc, to be freed with g_free. */
char* orb_reference(const Options* options, const char* name);
void orb_end(Orb* orb);

/* Whether a call succeeded; if not, logs it ("<what>: <exception>") and clears the environment. */
bool orb_succeeded(CORBA_Environment* ev, const char* what);

#endif /* CORBOT_ORBIT2_ORB_H */
