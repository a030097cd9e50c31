// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "planner/frame_settings.h"
#include "planner/plan/plan.h"

// Settings of clients, for a servant and for a dry run, in the units of the CORBA interface. Each check
// returns why a robot refuses a value. The functions take_...() need checked values.

namespace corbot {

[[nodiscard]] std::optional<PlanRefusal> check_joint_number(const ArmModel& arm, int joint);

[[nodiscard]] std::optional<PlanRefusal> check_tool_pitch(const Kinematics& arm, double degrees);
void take_tool_pitch(PlanSettings& settings, double degrees);
[[nodiscard]] std::optional<PlanRefusal> check_tool_orientation(const ArmModel& arm,
                                                                const Quaternion& orientation);
void take_tool_orientation(PlanSettings& settings, const Quaternion& orientation);
/// Removes pitch and orientation: each motion keeps the tool's orientation.
void take_any_orientation(PlanSettings& settings);

/// check_tool_frame() and check_base_frame() check these values.
void take_tool_frame(PlanSettings& settings, const Pose& flange_T_tool);
void take_base_frame(PlanSettings& settings, const Pose& world_T_base);
void take_profile_frames(PlanSettings& settings);

[[nodiscard]] JointRanges profile_ranges(const ArmModel& arm);
/// Converts limits in degrees and metres to soft limits for PlanSettings, within the profile's ranges.
[[nodiscard]] std::variant<JointRanges, PlanRefusal> soft_limits_of(const ArmModel& arm,
                                                                    const JointRanges& shown);
/// Refuses limits if the arm is outside them.
[[nodiscard]] std::optional<PlanRefusal> check_stands_within(const ArmModel& arm, const JointRanges& limits,
                                                             const Joints& position_q);

}  // namespace corbot
