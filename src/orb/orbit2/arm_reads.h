/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_READS_H
#define CORBOT_ORBIT2_ARM_READS_H

#include <arm.h>

/* Fills the attributes into the tables that all servants share. */
void arm_set_reads(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_READS_H */
