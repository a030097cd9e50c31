/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_SERVANT_H
#define CORBOT_ORBIT2_ARM_SERVANT_H

#include "orb/orbit2/arm_instance.h"

/* Implements Corbot::Arm with the C mapping: converts and calls corbot_robot.h, nothing else. */

/* The servant borrows the robot and the references. `target`: which of the objects of requests.h it is. */
void arm_servant_init(ArmServant* servant, corbot_robot* robot, const ControlReferences* references,
                      int target, CORBA_Environment* ev);
void arm_servant_fini(ArmServant* servant, CORBA_Environment* ev);

#endif /* CORBOT_ORBIT2_ARM_SERVANT_H */
