/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_CONTROL_REFERENCES_H
#define CORBOT_ORBIT2_CONTROL_REFERENCES_H

#include <arm.h>

#include "orb/orbit2/options.h"

/* The references that Acquire returns. Their object key is NAME/KEY, which requests.c accepts from any
 * process. A reference that one process has issued is therefore valid in the next one, too. */
typedef struct ControlReferences {
  CORBA_ORB orb;
  const Options* options;
  const char* robot;
} ControlReferences;

/* Returns nil, and an exception, if the reference cannot be made. */
Corbot_Arm control_reference(const ControlReferences* references, const char* key, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_CONTROL_REFERENCES_H */
