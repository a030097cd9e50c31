/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_NAMING_H
#define CORBOT_ORBIT2_NAMING_H

#include <orbit/orbit.h>

#include "orb/orbit2/options.h"

/* Keeps `Robots/<robot>.Robot` bound in a naming service, in a thread of its own. It binds when the service
 * comes up, and again after a restart or if the name points elsewhere. It works without the service while
 * that is down, and un-binds at the end. It logs each change once. */
typedef struct NameBinder NameBinder;

/* Binds the key `robot` at the options' endpoint, which outlives this process; an ORBit2 object's own
 * reference does not. The options must outlive the binder. */
NameBinder* name_binder_start(CORBA_ORB orb, const Options* options, const char* robot);
void name_binder_end(NameBinder* binder);

#endif /* CORBOT_ORBIT2_NAMING_H */
