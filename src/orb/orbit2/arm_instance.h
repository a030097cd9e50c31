/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_INSTANCE_H
#define CORBOT_ORBIT2_ARM_INSTANCE_H

#include <arm.h>

#include "orb/orbit2/waiting_calls.h"
#include "robot/corbot_robot.h"

/* One servant of Corbot::Arm, on which the operations are called. ORBit2 calls them from several threads at
 * once: what is below does not change after arm_servant_init, but for the count of waiting calls, which is
 * atomic; the robot is thread-safe. */
typedef struct ArmServant {
  POA_Corbot_Arm base; /* first, as the mapping requires */
  corbot_robot* robot;
  corbot_description description;
  WaitingCalls waiting;
} ArmServant;

/* What an operation is called on. */
static inline ArmServant* self_of(PortableServer_Servant servant) { return (ArmServant*)servant; }

#endif /* CORBOT_ORBIT2_ARM_INSTANCE_H */
