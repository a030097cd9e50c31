// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/solutions.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "planner/numeric/numeric_inverse.h"

namespace corbot::cli {
namespace {

constexpr double kSameRange_q = 1e-9;
/// Tolerance of an orientation.
constexpr double kSameOrientation_rad = 1e-6;

/// Returns the joint at the turn within its range, if there is one.
std::optional<Joints> within_range(const ArmModel& arm, std::size_t joint, const Joints& joints_q,
                                   const Joints& hint_q) {
  Joints lower_q, upper_q;
  lower_q.fill(-std::numeric_limits<double>::infinity());
  upper_q.fill(std::numeric_limits<double>::infinity());
  lower_q[joint] = arm.joints[joint].lower_q;
  upper_q[joint] = arm.joints[joint].upper_q;
  return arm.kinematics.within(lower_q, upper_q, kSameRange_q, joints_q, hint_q);
}

PoseSolution judged(const ArmModel& arm, PoseSolution solution, const Joints& hint_q) {
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const auto turned = within_range(arm, i, solution.joints_q, hint_q);
    if (turned) {
      solution.joints_q[i] = (*turned)[i];
    } else {
      solution.beyond_range.push_back(i);
    }
  }
  solution.regularity = regularity_at(arm.kinematics, solution.joints_q);
  return solution;
}

std::string describe(const IkSolution& refusal) {
  switch (refusal.status) {
    case IkStatus::kTooFar:
      return fmt::format(
          "too far: the pose needs a distance of {:.6g} m inside the arm, at most {:.6g} m is possible",
          refusal.distance_m, refusal.limit_m);
    case IkStatus::kTooClose:
      return fmt::format(
          "too close: the pose needs a distance of {:.6g} m inside the arm, at least {:.6g} m is possible",
          refusal.distance_m, refusal.limit_m);
    case IkStatus::kNotFinite:
      return "the pose is not finite";
    case IkStatus::kOk:
    case IkStatus::kNoSolution:
      break;
  }
  return "there is none";
}

void add_numeric(const ArmModel& arm, const Joints& hint_q, PoseSolutions& found) {
  const auto all = numeric::all_solutions(arm, found.pose, hint_q);
  for (std::uint32_t i = 0; i < all.count; ++i) {
    PoseSolution solution;
    solution.joints_q = all.joints_q[i];
    found.solutions.push_back(judged(arm, solution, hint_q));
  }
  if (all.count == 0) {
    found.refusal = fmt::format(
        "no solution was found: the nearest of {} searches stayed {:.3g} m and {:.3g} degrees away",
        all.seeds, all.nearest_m, all.nearest_rad * 180.0 / std::numbers::pi);
  }
}

}  // namespace

PoseSolutions solutions_at(const ArmModel& arm, const Pose& pose, bool with_orientation,
                           const Joints& hint_q) {
  PoseSolutions found{pose, {}, {}};
  if (arm.kinematics.solution_count() == 0) {
    add_numeric(arm, hint_q, found);
    return found;
  }
  const bool any = !with_orientation || arm.kinematics.follows() == Follows::kNone;
  const double limit_rad = any ? std::numbers::pi : kSameOrientation_rad;
  const SolutionSet set = arm.kinematics.solutions(pose, hint_q, limit_rad);
  for (const NumberedSolution& entry : set) {
    PoseSolution solution;
    solution.number = entry.number;
    solution.joints_q = entry.solution.joints_q;
    if (with_orientation) solution.orientation_error_rad = entry.solution.orientation_error_rad;
    found.solutions.push_back(judged(arm, solution, hint_q));
  }
  if (set.count > 0) return found;
  const SolutionSet any_orientation = arm.kinematics.solutions(pose, hint_q, std::numbers::pi);
  double nearest_rad = std::numbers::pi;
  for (const NumberedSolution& entry : any_orientation)
    nearest_rad = std::min(nearest_rad, entry.solution.orientation_error_rad);
  found.refusal =
      any_orientation.count == 0
          ? describe(any_orientation.refusal)
          : fmt::format(
                "the arm reaches the position, but its nearest orientation there is {:.4g} degrees off",
                nearest_rad * 180.0 / std::numbers::pi);
  return found;
}

}  // namespace corbot::cli
