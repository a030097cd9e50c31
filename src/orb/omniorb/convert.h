// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>
#include <cstddef>

#include "robot/corbot_robot.h"

// Convert records of corbot_robot.h to those of the interface.

namespace corbot::omni {

[[nodiscard]] Corbot::RobotState to_corba(corbot_state state);
[[nodiscard]] Corbot::JointCoord to_corba(const double (&joints)[CORBOT_MAX_JOINTS], CORBA::ULong count);
[[nodiscard]] Corbot::JointRanges to_corba(const double (&lower)[CORBOT_MAX_JOINTS],
                                           const double (&upper)[CORBOT_MAX_JOINTS], CORBA::ULong count);
[[nodiscard]] Corbot::JointList joints_of(const corbot_description& arm);
[[nodiscard]] Corbot::Pose to_corba(const corbot_tool_pose& tool);
[[nodiscard]] corbot_tool_pose from_corba(const Corbot::Pose& pose);
[[nodiscard]] Corbot::GripperInfo to_corba(const corbot_gripper_info& gripper);
void to_corba(const corbot_shape* shapes, std::size_t count, Corbot::WorkspaceShapes& to);
/// Converts back. A name that is too long fills its place and is refused by its length.
[[nodiscard]] corbot_shape to_shape(const Corbot::WorkspaceShape& shape);
/// Converts back.
void fill(const corbot_motion_info& from, Corbot::MotionInfo& to);
void fill(const corbot_device_info& from, Corbot::DeviceInfo& to);
/// `dof`: of the arm, here and below.
void fill(const corbot_plan& from, CORBA::ULong dof, Corbot::PlanInfo& to);
void fill(const corbot_arm_state& from, CORBA::ULong dof, Corbot::ArmState& to);

}  // namespace corbot::omni
