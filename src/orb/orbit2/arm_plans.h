/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_PLANS_H
#define CORBOT_ORBIT2_ARM_PLANS_H

#include <arm.h>

/* Fills in the plans, which start nothing; none of them waits. */
void arm_set_plans(POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_PLANS_H */
