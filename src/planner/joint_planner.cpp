// SPDX-License-Identifier: Apache-2.0
#include "planner/joint_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "corbot/motion/bounds.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/plan/refusal.h"
#include "planner/time_law_planner.h"
#include "planner/tool_goal.h"
#include "planner/workspace_proof.h"

namespace corbot {
namespace {

/// Plans time-optimal laws, not yet of equal duration. Returns the longest duration.
double plan_joints(const ArmModel& model, const Joints& speed_q_s, const Joints& from, const Joints& to,
                   JointMotion* motion) {
  double longest_s = 0.0;
  for (std::size_t i = 0; i < model.dof; ++i) {
    const JointLimits& limits = model.joints[i];
    const TimeLaw law = plan_law(to[i] - from[i], {speed_q_s[i], limits.acceleration_q_s2, limits.jerk_q_s3});
    longest_s = std::max(longest_s, law.duration_s());
    if (motion != nullptr) motion->law[i] = law;
  }
  return longest_s;
}

PlanResult joint_command(const ArmModel& model, const Joints& speed_q_s, const PlanStart& start,
                         const Joints& target, double t_s) {
  Command command = blank_command(MotionKind::kJoint, start);
  command.joint.frames = frames_of(model.kinematics);
  const double shortest_s = plan_joints(model, speed_q_s, start.position_q, target, &command.joint);
  const double duration_s = std::max(shortest_s, t_s);
  if (duration_s > kLongestPlan_s) return too_long(duration_s);
  for (std::size_t i = 0; i < model.dof; ++i) {
    TimeLaw& law = command.joint.law[i];
    if (law.duration_s() < duration_s) law = stretch(law, duration_s);
    // The end is the value that the real-time task computes. It differs from the requested value by a
    // rounding error.
    command.end_q[i] = start.position_q[i] + law.distance;
  }
  command.duration_s = duration_s;
  if (auto refusal = check_workspace(model, start.position_q, command.joint, duration_s)) return *refusal;
  return std::vector<Command>{command};
}

/// Puts each angle into its range by whole turns, as near to the present angle as possible. Returns the first
/// joint that no turn brings into its range, or −1.
int fit_ranges(const ArmModel& model, const Joints& present, Joints* target) {
  for (std::size_t i = 0; i < model.dof; ++i) {
    const JointLimits& limits = model.joints[i];
    double& value_q = (*target)[i];
    if (model.kinematics.joint_kind(i) == JointKind::kRotary) {
      const auto turned = turn_within(value_q, limits.lower_q, limits.upper_q, kRangeTolerance_q, present[i]);
      value_q = turned ? *turned : wrap_angle(value_q);
    }
    if (!in_range(limits, value_q)) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

JointPlanner::JointPlanner(const ArmModel& model, const PlanSettings& settings)
    : model_(model), settings_(settings) {
  for (std::size_t i = 0; i < model.dof; ++i) {
    speed_q_s_[i] = model.joints[i].speed_q_s * settings.speed_ratio * settings.joint_speed_ratio[i];
  }
}

PlanResult JointPlanner::to(const PlanStart& start, const Joints& target_q, double t_s) const {
  Joints target = start.position_q;
  std::copy_n(target_q.begin(), model_.dof, target.begin());
  return joint_command(model_, speed_q_s_, start, target, t_s);
}

PlanResult JointPlanner::reach(const PlanStart& start, const std::array<double, 3>& target_m,
                               double t_s) const {
  if (!model_.kinematics.has_closed_form()) return reach_numerically(start, target_m, t_s);
  const std::uint32_t present = model_.kinematics.solution_of(start.position_q).value_or(0);
  const std::uint32_t count = model_.kinematics.solution_count();
  std::vector<Way> ways;
  std::optional<PlanRefusal> out_of_range;
  std::optional<PlanRefusal> no_orientation;
  IkSolution out_of_reach;
  std::uint32_t refused = count;
  for (std::uint32_t i = 0; i < std::bit_ceil(count); ++i) {
    // The present solution comes first; the others follow in the order of their difference from it.
    const std::uint32_t number = i ^ present;
    if (number >= count) continue;
    const auto goal = goal_point(model_, settings_, start.position_q, target_m, number);
    if (const auto* refusal = std::get_if<PlanRefusal>(&goal)) {
      if (!no_orientation) no_orientation = *refusal;
      continue;
    }
    const IkSolution ik =
        joints_at_goal(model_.kinematics, settings_, std::get<PathPoint>(goal), number, start.position_q);
    if (ik.status != IkStatus::kOk) {
      if (number < refused) out_of_reach = ik;
      refused = std::min(refused, number);
      continue;
    }
    Joints target = start.position_q;
    std::copy_n(ik.joints_q.begin(), model_.dof, target.begin());
    const int joint = fit_ranges(model_, start.position_q, &target);
    if (joint >= 0) {
      const auto index = static_cast<std::size_t>(joint);
      if (!out_of_range) out_of_range = joint_range(model_, index, target[index], "at the target");
      continue;
    }
    const bool is_present = number == present;
    const double duration_s =
        is_present ? 0.0 : plan_joints(model_, speed_q_s_, start.position_q, target, nullptr);
    ways.push_back({duration_s, target});
    if (is_present && model_.workspace.count == 0) break;
  }
  if (!ways.empty()) return first_inside(start, std::move(ways), t_s);
  if (out_of_range) {
    out_of_range->target_m = target_m;
    return *out_of_range;
  }
  if (no_orientation) return *no_orientation;
  return unreachable(target_m, out_of_reach, "the target");
}

/// Tries all solutions and takes the quickest, as the solutions of a search have no numbers that are the same
/// at every place.
PlanResult JointPlanner::reach_numerically(const PlanStart& start, const std::array<double, 3>& target_m,
                                           double t_s) const {
  const auto goal = goal_point(model_, settings_, start.position_q, target_m, 0);
  if (const auto* refusal = std::get_if<PlanRefusal>(&goal)) return *refusal;
  const PathPoint& wanted = std::get<PathPoint>(goal);
  const numeric::NumericSolutions found =
      settings_.tool_orientation
          ? numeric::all_solutions(model_, Pose{target_m, *settings_.tool_orientation}, start.position_q)
          : numeric::all_solutions(model_, wanted, start.position_q);
  // With up to three joints the orientation is an output. Only some solutions have the orientation that is
  // set.
  const bool is_output = settings_.tool_orientation && model_.dof <= 3;
  std::vector<Way> ways;
  std::optional<PlanRefusal> out_of_range;
  for (std::uint32_t k = 0; k < found.count; ++k) {
    Joints target = found.joints_q[k];
    if (is_output && !has_orientation(model_, target, *settings_.tool_orientation)) continue;
    const int joint = fit_ranges(model_, start.position_q, &target);
    if (joint >= 0) {
      const auto index = static_cast<std::size_t>(joint);
      if (!out_of_range) out_of_range = joint_range(model_, index, target[index], "at the target");
      continue;
    }
    ways.push_back({plan_joints(model_, speed_q_s_, start.position_q, target, nullptr), target});
  }
  if (!ways.empty()) return first_inside(start, std::move(ways), t_s);
  if (!out_of_range) return not_found(target_m, found);
  out_of_range->target_m = target_m;
  return *out_of_range;
}

/// Takes the quickest way that keeps to the workspace. If none does, refuses with the reason of the quickest.
PlanResult JointPlanner::first_inside(const PlanStart& start, std::vector<Way> ways, double t_s) const {
  std::stable_sort(ways.begin(), ways.end(),
                   [](const Way& a, const Way& b) { return a.duration_s < b.duration_s; });
  std::optional<PlanResult> first;
  for (const Way& way : ways) {
    PlanResult plan = joint_command(model_, speed_q_s_, start, way.target_q, t_s);
    const auto* refusal = std::get_if<PlanRefusal>(&plan);
    if (refusal == nullptr || !leaves_workspace(*refusal)) return plan;
    if (!first) first = std::move(plan);
  }
  return *first;
}

PlanResult JointPlanner::drive(const PlanStart& start, const DriveRequest& request) const {
  const auto joint = static_cast<std::size_t>(request.joint);
  Joints target = start.position_q;
  target[joint] += request.increment_q;
  if (!in_range(model_.joints[joint], target[joint]))
    return joint_range(model_, joint, target[joint], "at the end");
  Joints speed_q_s = speed_q_s_;
  speed_q_s[joint] = std::min(speed_q_s[joint], request.speed_q_s);
  return joint_command(model_, speed_q_s, start, target, 0.0);
}

}  // namespace corbot
