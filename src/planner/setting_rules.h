// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "planner/frame_settings.h"
#include "planner/plan/plan.h"

// What clients may set, for a servant and for a dry run. Values are in the units of the CORBA interface. Each check says why a
// robot refuses a value; what takes a value needs one that was checked.

namespace corbot {

[[nodiscard]] std::optional<PlanRefusal> check_joint_number(const ArmModel& arm, int joint);

[[nodiscard]] std::optional<PlanRefusal> check_tool_pitch(const Kinematics& arm, double degrees);
void take_tool_pitch(PlanSettings& settings, double degrees);
[[nodiscard]] std::optional<PlanRefusal> check_tool_orientation(const ArmModel& arm,
                                                                const Quaternion& orientation);
void take_tool_orientation(PlanSettings& settings, const Quaternion& orientation);
/// Neither pitch nor orientation: each motion keeps the orientation that the tool has.
void take_any_orientation(PlanSettings& settings);

/// Their checks are check_tool_frame() and check_base_frame().
void take_tool_frame(PlanSettings& settings, const Pose& flange_T_tool);
void take_base_frame(PlanSettings& settings, const Pose& world_T_base);
void take_profile_frames(PlanSettings& settings);

[[nodiscard]] JointRanges profile_ranges(const ArmModel& arm);
/// Soft limits for PlanSettings, within the profile's ranges, of limits that are degrees and metres.
[[nodiscard]] std::variant<JointRanges, PlanRefusal> soft_limits_of(const ArmModel& arm,
                                                                    const JointRanges& shown);
/// Refuses limits outside which the arm stands.
[[nodiscard]] std::optional<PlanRefusal> check_stands_within(const ArmModel& arm, const JointRanges& limits,
                                                             const Joints& position_q);

}  // namespace corbot
