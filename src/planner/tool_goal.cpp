// SPDX-License-Identifier: Apache-2.0
#include "planner/tool_goal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path_joints.h"
#include "corbot/units.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

constexpr double kSameAngle_rad = 1e-12;             // a smaller rotation of the tool is rounding error
constexpr double kLeastOrientationError_rad = 1e-6;  // the error that a limit of 0 allows

/// Returns the rotation vector from one orientation to another, base frame, at most half a turn long.
Vector3 turn_between(const Quaternion& from, const Quaternion& to) noexcept {
  const Quaternion d = to * conjugate(from);
  const double sign = d.w < 0.0 ? -1.0 : 1.0;
  const Vector3 axis{sign * d.x, sign * d.y, sign * d.z};
  const double sine = norm(axis);
  const double angle_rad = double_angle(sine, std::abs(d.w));
  return angle_rad > kSameAngle_rad ? (angle_rad / sine) * axis : Vector3{};
}

/// Returns the angle nearest to `present_rad` that equals `wanted_rad` modulo whole turns.
double angle_towards(double present_rad, double wanted_rad) noexcept {
  const double turn_rad = wrap_angle(wanted_rad - present_rad);
  return std::abs(turn_rad) <= kSameAngle_rad ? present_rad : present_rad + turn_rad;
}

double orientation_limit_rad(const ArmModel& model) {
  return std::max(model.orientation_error_rad, kLeastOrientationError_rad);
}

PlanRefusal off_orientation(const Vector3& target_m, double error_rad, double limit_rad) {
  PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "orientation", Quantity::kAngle);
  refusal.value = error_rad;
  refusal.upper = limit_rad;
  refusal.target_m = target_m;
  refusal.text = fmt::format(
      "at ({:.6g}, {:.6g}, {:.6g}) m this arm comes no nearer to that orientation than {:.6g} degrees, "
      "allowed up to {:.6g} degrees (orientation_error_deg)",
      target_m[0], target_m[1], target_m[2], to_degrees(error_rad), to_degrees(limit_rad));
  return refusal;
}

/// Returns, without a closed form, the solution of a search that is nearest to the present joints. With four
/// or five joints a search finds only orientations that the arm can take.
std::variant<PathPoint, PlanRefusal> nearest_found(const ArmModel& model, const Quaternion& wanted,
                                                   const Joints& present_q, const Vector3& target_m) {
  const numeric::NumericSolutions found = numeric::all_solutions(model, Pose{target_m, wanted}, present_q);
  const double limit_rad = orientation_limit_rad(model);
  double least_rad = std::numeric_limits<double>::infinity(), least_q = least_rad;
  Joints best{};
  for (std::uint32_t k = 0; k < found.count; ++k) {
    const Joints& q = found.joints_q[k];
    const double error_rad = angle_between(model.kinematics.forward(q).orientation, normalised(wanted));
    least_rad = std::min(least_rad, error_rad);
    double farthest_q = 0.0;
    for (std::size_t i = 0; i < model.dof; ++i)
      farthest_q = std::max(farthest_q, std::abs(q[i] - present_q[i]));
    if (error_rad > limit_rad || farthest_q >= least_q) continue;
    least_q = farthest_q;
    best = q;
  }
  if (found.count == 0) return not_found(target_m, found);
  if (least_rad > limit_rad) return off_orientation(target_m, least_rad, limit_rad);
  return PathPoint{target_m, wanted, model.kinematics.followed().at(best)};
}

/// Returns the orientation nearest to the requested one, as the followed angles at the joints that have it.
std::variant<PathPoint, PlanRefusal> nearest(const ArmModel& model, const Quaternion& wanted,
                                             const Joints& present_q, const Vector3& target_m,
                                             std::uint32_t solution) {
  if (!model.kinematics.has_closed_form()) return nearest_found(model, wanted, present_q, target_m);
  const IkSolution ik = model.kinematics.inverse({target_m, wanted}, solution, present_q);
  if (ik.status != IkStatus::kOk) return unreachable(target_m, ik, "the target");
  const double limit_rad = orientation_limit_rad(model);
  if (ik.orientation_error_rad > limit_rad)
    return off_orientation(target_m, ik.orientation_error_rad, limit_rad);
  return PathPoint{target_m, wanted, model.kinematics.followed().at(ik.joints_q)};
}

}  // namespace

PathPoint present_point(const Kinematics& arm, const Joints& q) noexcept {
  const Pose pose = arm.forward(q);
  return {pose.position_m, pose.orientation, arm.followed().at(q)};
}

std::variant<PathPoint, PlanRefusal> goal_point(const ArmModel& model, const PlanSettings& settings,
                                                const Joints& present_q, const Vector3& target_m,
                                                std::uint32_t solution) {
  const Kinematics& arm = model.kinematics;
  PathPoint goal = present_point(arm, present_q);
  goal.position_m = target_m;
  if (settings.tool_orientation) {
    if (arm.follows() != Follows::kFull) {
      return nearest(model, *settings.tool_orientation, present_q, target_m, solution);
    }
    goal.orientation = *settings.tool_orientation;
  } else if (arm.follows() == Follows::kPitch) {
    goal.angles_rad[0] =
        angle_towards(goal.angles_rad[0], angle_of_pitch(arm, settings.tool_pitch_rad.value_or(0.0)));
  } else if (has_tool_pitch(arm) && settings.tool_pitch_rad) {
    goal.angles_rad[0] = angle_towards(goal.angles_rad[0], angle_of_pitch(arm, *settings.tool_pitch_rad));
  }
  return goal;
}

bool has_orientation(const ArmModel& model, const Joints& q, const Quaternion& wanted) noexcept {
  return angle_between(model.kinematics.forward(q).orientation, wanted) <= orientation_limit_rad(model);
}

IkSolution joints_at_goal(const Kinematics& arm, const PlanSettings& settings, const PathPoint& goal,
                          std::uint32_t solution, const Joints& hint) noexcept {
  if (settings.tool_orientation) return arm.inverse({goal.position_m, goal.orientation}, solution, hint);
  return inverse_at(arm, goal, solution, hint);
}

PoseGoal goal_at(const PlanSettings& settings, const Pose& target) {
  PoseGoal goal{target.position_m, settings};
  goal.settings.tool_pitch_rad.reset();
  goal.settings.tool_orientation = normalised(target.orientation);
  return goal;
}

PoseGoal goal_by(const Kinematics& arm, const PlanSettings& settings, const Joints& present_q,
                 const MoveRelativeRequest& request) {
  const Pose here = arm.forward(present_q);
  const Pose by{request.offset.position_m, normalised(request.offset.orientation)};
  const Pose there = request.frame == OffsetFrame::kTool
                         ? here * by
                         : Pose{here.position_m + by.position_m, by.orientation * here.orientation};
  if (angle_between({}, by.orientation) > kSameAngle_rad) return goal_at(settings, there);
  PoseGoal goal{there.position_m, settings};
  goal.settings.tool_orientation.reset();
  goal.settings.tool_pitch_rad.reset();
  if (arm.follows() == Follows::kPitch)  // otherwise the arm would not keep its own pitch
    goal.settings.tool_pitch_rad = pitch_of_angle(arm, arm.followed().at(present_q)[0]);
  return goal;
}

OrientationPath orientation_path(const Kinematics& arm, const PathPoint& from, const PathPoint& to) noexcept {
  OrientationPath path{};
  if (arm.follows() == Follows::kFull) {
    path.from = normalised(from.orientation);
    path.turn_rad = turn_between(path.from, normalised(to.orientation));
    return path;
  }
  for (std::size_t k = 0; k < arm.followed().count; ++k) {
    path.from_angles_rad[k] = from.angles_rad[k];
    path.to_angles_rad[k] = angle_towards(from.angles_rad[k], to.angles_rad[k]);
  }
  return path;
}

}  // namespace corbot
