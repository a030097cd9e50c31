// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/frames.h"
#include "planner/plan/plan.h"

namespace corbot {

/// The profile's frames, but for those that are set.
[[nodiscard]] Frames frames_in_force(const Kinematics& arm, const PlanSettings& settings) noexcept;
/// The arm in the frames in force.
[[nodiscard]] Kinematics in_frames(const Kinematics& arm, const PlanSettings& settings) noexcept;

/// Refuses a frame that is not finite, not of unit length within 1e-6 or beyond kFarthestBase_m, kFarthestTool_m, and a tool with
/// which the arm can do less than without: `name` is the parameter's.
[[nodiscard]] std::optional<PlanRefusal> check_base_frame(const Pose& world_T_base);
[[nodiscard]] std::optional<PlanRefusal> check_tool_frame(const Kinematics& arm, const Pose& flange_T_tool);

}  // namespace corbot
