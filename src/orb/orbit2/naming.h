/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_NAMING_H
#define CORBOT_ORBIT2_NAMING_H

#include <orbit/orbit.h>

#include "orb/orbit2/options.h"

/* Keeps `Robots/<robot>.Robot` bound in a naming service, in a thread of its own: binds when the service
 * comes up, binds anew when it has been restarted or the name points elsewhere, goes on without it while it
 * is down, and un-binds at the end. Logs each change once. */
typedef struct NameBinder NameBinder;

/* Binds the key `robot` at the options' endpoint, which outlives this process; an ORBit2 object's own
 * reference does not. The options must outlive the binder. */
NameBinder* name_binder_start(CORBA_ORB orb, const Options* options, const char* robot);
void name_binder_end(NameBinder* binder);

#endif /* CORBOT_ORBIT2_NAMING_H */
