/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_SERVANT_H
#define CORBOT_ORBIT2_ARM_SERVANT_H

#include <arm.h>

#include "orb/orbit2/waiting_calls.h"
#include "robot/corbot_robot.h"

/* Corbot::Arm by the C mapping: converts and calls corbot_robot.h, nothing else. ORBit2 calls it from several
 * threads at once: what is below does not change after arm_servant_init, but for the count of waiting calls,
 * which is atomic; the robot is thread-safe. */
typedef struct ArmServant {
  POA_Corbot_Arm base; /* first, as the mapping asks */
  corbot_robot* robot;
  corbot_description description;
  WaitingCalls waiting;
} ArmServant;

/* What an operation is called on. */
static inline ArmServant* self_of(PortableServer_Servant servant) { return (ArmServant*)servant; }

/* The servant borrows the robot. */
void arm_servant_init(ArmServant* servant, corbot_robot* robot, int waiting_calls, CORBA_Environment* ev);
void arm_servant_fini(ArmServant* servant, CORBA_Environment* ev);

/* Fill the operations into the tables that all servants share: motions, waited for or only started
 * (arm_motions.c), and what returns at once (arm_immediate.c). */
void arm_set_motions(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm);
void arm_set_immediate(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_SERVANT_H */
