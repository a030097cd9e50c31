// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/closed_form.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/plan/plan.h"

namespace corbot {

[[nodiscard]] PlanRefusal bad_parameter(std::string parameter, Quantity quantity, double value, double lower,
                                        double upper, std::string text, int joint = -1);
/// `status` is kTooFar or kTooClose; `where` names the point, e.g. "the target".
[[nodiscard]] PlanRefusal unreachable(const std::array<double, 3>& point_m, const IkSolution& result,
                                      const std::string& where);
/// Refuses a target that no search reached, for an arm without a closed form.
[[nodiscard]] PlanRefusal not_found(const std::array<double, 3>& point_m,
                                    const numeric::NumericSolutions& searched);
/// Returns the value in degrees or metres as text.
[[nodiscard]] std::string shown_joint(JointKind kind, double value_q);
[[nodiscard]] PlanRefusal joint_range(const ArmModel& model, std::size_t joint, double value_q,
                                      const std::string& where);
[[nodiscard]] PlanRefusal joint_range(std::size_t joint, JointKind kind, double value_q,
                                      const JointLimits& limits, const std::string& where);
[[nodiscard]] PlanRefusal too_long(double duration_s);

/// Refuses a path for an arm of fewer than three joints.
[[nodiscard]] PlanRefusal follows_no_path(std::size_t dof, const std::array<double, 3>& target_m);

/// Refuses a time that is not finite, negative or above kLongestPlan_s.
[[nodiscard]] std::optional<PlanRefusal> check_time(double t_s);
/// Refuses coordinates that are not finite or beyond kFarthestCoordinate_m.
[[nodiscard]] std::optional<PlanRefusal> check_point(const std::array<double, 3>& point_m,
                                                     const std::string& name);
/// Refuses a pose if its position is refused as a point, or its quaternion is not of unit length within
/// kUnitLengthTolerance.
[[nodiscard]] std::optional<PlanRefusal> check_pose(const Pose& pose, const std::string& name);
/// Checks the orientation alone; `what` names it for the text, e.g. "the orientation of target".
[[nodiscard]] std::optional<PlanRefusal> check_orientation(const Quaternion& orientation,
                                                           const std::string& name, const std::string& what);
inline constexpr double kUnitLengthTolerance = 1e-6;
/// Refuses a set orientation that is invalid.
[[nodiscard]] std::optional<PlanRefusal> check_tool(const PlanSettings& settings);

/// Returns true if the value is within the joint's range, with a tolerance of kRangeTolerance_q.
[[nodiscard]] bool in_range(const JointLimits& limits, double value_q) noexcept;

/// Returns a command of this kind that begins and ends at `start`, with all else zero.
[[nodiscard]] Command blank_command(MotionKind kind, const PlanStart& start) noexcept;

}  // namespace corbot
