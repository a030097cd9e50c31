/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/control_references.h"

#include <string.h>

#include "orb/orbit2/ior.h"

static const char kArm[] = "IDL:Corbot/Arm:1.0";

Corbot_Arm control_reference(const ControlReferences* references, const char* key, CORBA_Environment* ev) {
  const Options* options = references->options;
  char* object_key = g_strdup_printf("%s/%s", references->robot, key);
  char* ior = options->unix_path != NULL
                  ? ior_make_unix(kArm, options->unix_path, object_key, (unsigned)strlen(object_key))
                  : ior_make(kArm, options->endpoint.host, options->endpoint.port, object_key,
                             (unsigned)strlen(object_key));
  Corbot_Arm reference = (Corbot_Arm)CORBA_ORB_string_to_object(references->orb, ior, ev);
  g_free(ior);
  g_free(object_key);
  return reference;
}
