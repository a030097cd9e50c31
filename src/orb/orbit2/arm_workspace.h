/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_ARM_WORKSPACE_H
#define CORBOT_ORBIT2_ARM_WORKSPACE_H

#include <arm.h>

/* Fills in the workspace, and its changes. */
void arm_set_workspace(POA_Corbot_Arm__epv* arm);

#endif /* CORBOT_ORBIT2_ARM_WORKSPACE_H */
