/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_MOTIONS_H
#define CORBOT_ORBIT2_ARM_MOTIONS_H

#include <arm.h>

/* Fills the motions, waited for or only started, into the tables that all servants share. */
void arm_set_motions(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_MOTIONS_H */
