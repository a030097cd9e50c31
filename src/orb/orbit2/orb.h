/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ORB_H
#define CORBOT_ORBIT2_ORB_H

#include <orbit/orbit.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/options.h"
#include "orb/orbit2/requests.h"

/* An ORB that listens. It has a POA whose objects several threads serve at once. Two more POAs have a single
 * thread each, for refused calls and for Stops that wait with another one. */
typedef struct Orb {
  CORBA_ORB orb;
  PortableServer_POA root;
  PortableServer_POA poa;
  PortableServer_POA refusing;
  PortableServer_POA joining;
} Orb;

/* Starts the ORB. Returns false, with the reason in the log, on failure. */
bool orb_start(Orb* orb, const Options* options);
/* Activates the servants, one for each target, registers the robot under the object key `name`, and begins to
 * serve. Returns false, with the reason in the log, if the robot could not be reached. */
bool orb_serve(Orb* orb, const Options* options, ArmServant servants[kTargets], const char* name);
/* Returns the object's address for clients as a corbaloc, to be freed with g_free. */
char* orb_reference(const Options* options, const char* name);
void orb_end(Orb* orb);

/* Returns true if a call succeeded; else logs it ("<what>: <exception>") and clears the environment. */
bool orb_succeeded(CORBA_Environment* ev, const char* what);

#endif /* CORBOT_ORBIT2_ORB_H */
