/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_INSTANCE_H
#define CORBOT_ORBIT2_ARM_INSTANCE_H

#include <arm.h>

#include "orb/orbit2/control_references.h"
#include "robot/corbot_robot.h"

/* One servant of Corbot::Arm: one of several objects for the same robot, see requests.h. ORBit2 calls its
 * operations from several threads at once. The members do not change after arm_servant_init and the ORB's
 * start; the robot is thread-safe. */
typedef struct ArmServant {
  POA_Corbot_Arm base; /* first, as the mapping requires */
  corbot_robot* robot;
  const ControlReferences* references;
  corbot_description description;
  int target; /* which of the objects of requests.h */
} ArmServant;

/* Returns the object on which an operation is called. */
static inline ArmServant* self_of(PortableServer_Servant servant) { return (ArmServant*)servant; }

#endif /* CORBOT_ORBIT2_ARM_INSTANCE_H */
