/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_POSES_H
#define CORBOT_ORBIT2_ARM_POSES_H

#include <arm.h>

/* Fills in the motions to a pose and by an offset. */
void arm_set_poses(POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_POSES_H */
