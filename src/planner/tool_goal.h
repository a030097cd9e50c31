// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path.h"
#include "planner/plan/plan.h"
#include "planner/request.h"

namespace corbot {

/// Returns the position of the tool centre point at these joints, its orientation, and the angles that the
/// arm follows.
[[nodiscard]] PathPoint present_point(const Kinematics& arm, const Joints& q) noexcept;

/// Returns the end of a motion to `target_m` on one solution. The orientation is that of the settings, else
/// the tool's at `present_q`. An arm of fewer than six joints takes the nearest orientation; if its error
/// exceeds ArmModel::orientation_error_rad, the motion is refused.
[[nodiscard]] std::variant<PathPoint, PlanRefusal> goal_point(const ArmModel& model,
                                                              const PlanSettings& settings,
                                                              const Joints& present_q,
                                                              const Vector3& target_m,
                                                              std::uint32_t solution);

/// Returns true if the tool's orientation at these joints equals `wanted` within the limit.
[[nodiscard]] bool has_orientation(const ArmModel& model, const Joints& q, const Quaternion& wanted) noexcept;

/// Returns the joints at a goal on one solution. Solves an orientation in the settings as a pose.
[[nodiscard]] IkSolution joints_at_goal(const Kinematics& arm, const PlanSettings& settings,
                                        const PathPoint& goal, std::uint32_t solution,
                                        const Joints& hint) noexcept;

/// Position and settings with which a motion to a point ends at a whole pose.
struct PoseGoal {
  Vector3 target_m{};
  PlanSettings settings{};
};
/// The orientation need only be of about unit length.
[[nodiscard]] PoseGoal goal_at(const PlanSettings& settings, const Pose& target);
/// Returns the goal of an offset from these joints.
[[nodiscard]] PoseGoal goal_by(const Kinematics& arm, const PlanSettings& settings, const Joints& present_q,
                               const MoveRelativeRequest& request);

/// Returns the path from one point's orientation to the other's: about one axis by the shorter turn, or angle
/// by angle.
[[nodiscard]] OrientationPath orientation_path(const Kinematics& arm, const PathPoint& from,
                                               const PathPoint& to) noexcept;

}  // namespace corbot
