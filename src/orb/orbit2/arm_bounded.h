/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_BOUNDED_H
#define CORBOT_ORBIT2_ARM_BOUNDED_H

#include <arm.h>

/* Puts the bounds of places.h around Stop and the operations that change how the arm moves. To be called
 * once, after the tables are filled. */
void arm_bound(POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_BOUNDED_H */
