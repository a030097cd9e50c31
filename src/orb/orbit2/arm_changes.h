/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_CHANGES_H
#define CORBOT_ORBIT2_ARM_CHANGES_H

#include <arm.h>

/* Fills settings, Stop and related operations, and exclusive control into the tables that all servants share.
 */
void arm_set_changes(POA_Corbot_Robot__epv* robot, POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_CHANGES_H */
