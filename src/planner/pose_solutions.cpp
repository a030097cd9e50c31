// SPDX-License-Identifier: Apache-2.0
#include "planner/pose_solutions.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "corbot/kinematics/angles.h"
#include "corbot/motion/bounds.h"
#include "corbot/units.h"
#include "planner/frame_settings.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

struct Ranges {
  Joints lower_q{}, upper_q{};
};

Ranges ranges_of(const ArmModel& model, const PlanSettings& settings) {
  Ranges ranges;
  for (std::size_t i = 0; i < model.dof; ++i) {
    ranges.lower_q[i] = settings.soft_limits ? settings.soft_limits->lower_q[i] : model.joints[i].lower_q;
    ranges.upper_q[i] = settings.soft_limits ? settings.soft_limits->upper_q[i] : model.joints[i].upper_q;
  }
  return ranges;
}

PoseSolution judged(const Kinematics& arm, const Ranges& ranges, const Joints& hint_q,
                    PoseSolution solution) {
  solution.in_range = true;
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    double& value_q = solution.joints_q[i];
    const double lower_q = ranges.lower_q[i], upper_q = ranges.upper_q[i];
    if (arm.joint_kind(i) == JointKind::kPrismatic) {
      solution.in_range &= value_q >= lower_q - kRangeTolerance_q && value_q <= upper_q + kRangeTolerance_q;
      continue;
    }
    const auto turn = turn_within(value_q, lower_q, upper_q, kRangeTolerance_q, hint_q[i]);
    solution.in_range &= turn.has_value();
    value_q = turn.value_or(value_q);
  }
  return solution;
}

std::optional<PlanRefusal> check_pose(const Pose& pose) {
  if (auto refusal = check_point(pose.position_m, "target")) return refusal;
  const double length = std::sqrt(squared_norm(pose.orientation));
  if (std::abs(length - 1.0) <= kUnitLengthTolerance) return std::nullopt;
  return bad_parameter(
      "target", Quantity::kNumber, length, 1.0 - kUnitLengthTolerance, 1.0 + kUnitLengthTolerance,
      fmt::format("the quaternion has length {:.9g}, allowed 1 within {:.0e}", length, kUnitLengthTolerance));
}

}  // namespace

std::variant<std::vector<PoseSolution>, PlanRefusal> solutions_at(const ArmModel& model,
                                                                  const PlanSettings& settings,
                                                                  const Pose& pose, const Joints& hint_q) {
  if (auto refusal = check_pose(pose)) return *refusal;
  const Kinematics arm = in_frames(model.kinematics, settings);
  const Pose wanted{pose.position_m, normalised(pose.orientation)};
  const Ranges ranges = ranges_of(model, settings);
  std::vector<PoseSolution> all;
  if (arm.solution_count() == 0) {
    const auto found = numeric::all_solutions(arm.chain(), wanted, hint_q, {ranges.lower_q, ranges.upper_q});
    for (std::uint32_t i = 0; i < found.count; ++i)
      all.push_back(judged(arm, ranges, hint_q, {i, found.joints_q[i]}));
    if (!all.empty()) return all;
    PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "target", Quantity::kLength);
    refusal.value = found.nearest_m;
    refusal.target_m = wanted.position_m;
    refusal.text =
        fmt::format("none was found: the nearest of {} searches stayed {:.3g} m and {:.3g} degrees away",
                    found.seeds, found.nearest_m, to_degrees(found.nearest_rad));
    return refusal;
  }
  const SolutionSet set = arm.solutions(wanted, hint_q, std::numbers::pi + kUnitLengthTolerance);
  for (const NumberedSolution& entry : set) {
    all.push_back(
        judged(arm, ranges, hint_q,
               {entry.number, entry.solution.joints_q, false, entry.solution.orientation_error_rad}));
  }
  if (!all.empty()) return all;
  return unreachable(wanted.position_m, set.refusal, "the target");
}

std::optional<std::uint32_t> solution_in_use(const ArmModel& model, const PlanSettings& settings,
                                             const Joints& joints_q) noexcept {
  return in_frames(model.kinematics, settings).solution_of(joints_q);
}

}  // namespace corbot
