/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_FRAMES_H
#define CORBOT_ORBIT2_ARM_FRAMES_H

#include <arm.h>

/* Fills in tool frame, base frame and solutions; none of them waits. */
void arm_set_frames(POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_FRAMES_H */
