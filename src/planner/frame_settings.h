// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/frames.h"
#include "planner/plan/plan.h"

namespace corbot {

/// Returns the frames that are set, else the profile's.
[[nodiscard]] Frames frames_in_force(const Kinematics& arm, const PlanSettings& settings) noexcept;
/// Returns the arm in the frames in force.
[[nodiscard]] Kinematics in_frames(const Kinematics& arm, const PlanSettings& settings) noexcept;

/// Refuse a frame that is not finite or not of unit length within 1e-6. Refuse a frame beyond kFarthestBase_m
/// or kFarthestTool_m. check_tool_frame() also refuses a tool that reduces the motions that the arm can make.
[[nodiscard]] std::optional<PlanRefusal> check_base_frame(const Pose& world_T_base);
[[nodiscard]] std::optional<PlanRefusal> check_tool_frame(const Kinematics& arm, const Pose& flange_T_tool);

}  // namespace corbot
