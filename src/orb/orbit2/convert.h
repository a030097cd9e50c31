/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_CONVERT_H
#define CORBOT_ORBIT2_CONVERT_H

#include <arm.h>

#include "robot/corbot_robot.h"

/* Convert records of corbot_robot.h to those of the interface. Strings and sequences in *to are allocated; it
 * owns nothing before. */
Corbot_RobotState convert_state(corbot_state state);
void convert_joints(const double joints[CORBOT_MAX_JOINTS], int32_t count, Corbot_JointCoord* to);
Corbot_GripperInfo convert_gripper(const corbot_gripper_info* gripper);
Corbot_Pose convert_pose(const corbot_tool_pose* tool);
corbot_tool_pose convert_to_pose(const Corbot_Pose* pose);
void convert_motion(const corbot_motion_info* from, Corbot_MotionInfo* to);
void convert_device(const corbot_device_info* from, Corbot_DeviceInfo* to);
void convert_plan(const corbot_plan* from, int32_t dof, Corbot_PlanInfo* to);
void convert_arm_state(const corbot_arm_state* from, int32_t dof, Corbot_ArmState* to);

#endif /* CORBOT_ORBIT2_CONVERT_H */
