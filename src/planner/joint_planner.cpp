// SPDX-License-Identifier: Apache-2.0
// Joint-space motions, the gripper and waiting.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "corbot/motion/law_evaluation.h"
#include "corbot/units.h"
#include "planner/planner.h"
#include "planner/refusal.h"
#include "planner/time_law_planner.h"

namespace corbot {
namespace {

using Speeds = std::array<double, kMaxJoints>;

Speeds scaled_speeds(const ArmModel& model, const PlanSettings& settings) {
  Speeds speeds{};
  for (std::size_t i = 0; i < model.dof; ++i) {
    speeds[i] = model.joints[i].speed_rad_s * settings.speed_ratio * settings.joint_speed_ratio[i];
  }
  return speeds;
}

/// Time-optimal laws, not yet of equal duration; returns the longest duration.
double plan_joints(const ArmModel& model, const Speeds& speeds, const Joints& from, const Joints& to,
                   JointMotion* motion) {
  double longest_s = 0.0;
  for (std::size_t i = 0; i < model.dof; ++i) {
    const JointLimits& limits = model.joints[i];
    const TimeLaw law =
        plan_law(to[i] - from[i], {speeds[i], limits.acceleration_rad_s2, limits.jerk_rad_s3});
    longest_s = std::max(longest_s, law.duration_s());
    if (motion != nullptr) motion->law[i] = law;
  }
  return longest_s;
}

PlanResult joint_command(const ArmModel& model, const Speeds& speeds, const PlanStart& start,
                         const Joints& target, double t_s) {
  Command command = blank_command(MotionKind::kJoint, start);
  const double shortest_s = plan_joints(model, speeds, start.position_rad, target, &command.joint);
  const double duration_s = std::max(shortest_s, t_s);
  if (duration_s > kLongestPlan_s) return too_long(duration_s);
  for (std::size_t i = 0; i < model.dof; ++i) {
    TimeLaw& law = command.joint.law[i];
    if (law.duration_s() < duration_s) law = stretch(law, duration_s);
    // As the real-time task will compute it, not as it was asked for: the two differ by a rounding.
    command.end_rad[i] = start.position_rad[i] + law.distance;
  }
  command.duration_s = duration_s;
  return std::vector<Command>{command};
}

/// Puts each angle into its range by whole turns, nearest to where the joint is. Returns the joint that no
/// turn brings into its range, −1 where all are.
int fit_ranges(const ArmModel& model, const Joints& present, Joints* target) {
  for (std::size_t i = 0; i < 4; ++i) {
    double best = std::numeric_limits<double>::quiet_NaN();
    for (const int turns : {0, -1, 1, -2, 2}) {
      const double candidate = (*target)[i] + turns * 2.0 * std::numbers::pi;
      if (!in_range(model.joints[i], candidate)) continue;
      if (std::isnan(best) || std::abs(candidate - present[i]) < std::abs(best - present[i]))
        best = candidate;
    }
    if (std::isnan(best)) return static_cast<int>(i);
    (*target)[i] = best;
  }
  return -1;
}

}  // namespace

PlanResult Planner::move(const PlanStart& start, const PlanSettings& settings,
                         const std::array<double, 3>& target_m, double t_s) const {
  if (auto refusal = check_kinematics(model_, settings)) return *refusal;
  if (auto refusal = check_point(target_m, "P")) return *refusal;
  if (auto refusal = check_time(t_s)) return *refusal;

  const Speeds speeds = scaled_speeds(model_, settings);
  const Branch present = branch_of(model_.geometry, start.position_rad);
  double best_s = std::numeric_limits<double>::infinity();
  Joints best{};
  std::optional<PlanRefusal> out_of_range;
  IkResult out_of_reach;
  for (std::uint32_t i = 0; i < kBranchCount; ++i) {
    // The present branch first; the others follow in their order.
    const auto branch = static_cast<Branch>(i ^ static_cast<std::uint32_t>(present));
    const IkResult ik =
        inverse(model_.geometry, target_m, settings.tool_pitch_rad, branch, start.position_rad[0]);
    if (ik.status != IkStatus::kOk) {
      if (!is_backward(branch)) out_of_reach = ik;
      continue;
    }
    Joints target = start.position_rad;
    std::copy_n(ik.position_rad.begin(), 4, target.begin());
    const int joint = fit_ranges(model_, start.position_rad, &target);
    if (joint >= 0) {
      const auto index = static_cast<std::size_t>(joint);
      if (!out_of_range)
        out_of_range = joint_range(joint, target[index], model_.joints[index], "at the target");
      continue;
    }
    const double duration_s = plan_joints(model_, speeds, start.position_rad, target, nullptr);
    if (duration_s < best_s) {
      best_s = duration_s;
      best = target;
    }
    if (branch == present) break;
  }
  if (std::isfinite(best_s)) return joint_command(model_, speeds, start, best, t_s);
  if (out_of_range) {
    out_of_range->target_m = target_m;
    return *out_of_range;
  }
  return unreachable(target_m, out_of_reach, "the target");
}

PlanResult Planner::move_joints(const PlanStart& start, const PlanSettings& settings,
                                const Joints& target_rad, double t_s) const {
  if (auto refusal = check_time(t_s)) return *refusal;
  Joints target = start.position_rad;
  for (std::size_t i = 0; i < model_.dof; ++i) {
    const JointLimits& limits = model_.joints[i];
    const int joint = static_cast<int>(i);
    if (!std::isfinite(target_rad[i])) {
      return bad_parameter("angle", target_rad[i], limits.lower_rad, limits.upper_rad,
                           fmt::format("the angle of articulation {} is not a finite number", i), joint);
    }
    if (!in_range(limits, target_rad[i])) return joint_range(joint, target_rad[i], limits, "at the target");
    target[i] = target_rad[i];
  }
  return joint_command(model_, scaled_speeds(model_, settings), start, target, t_s);
}

PlanResult Planner::ready(const PlanStart& start, const PlanSettings& settings) const {
  return move_joints(start, settings, Joints{}, 0.0);
}

PlanResult Planner::drive(const PlanStart& start, const PlanSettings& settings, int articulation,
                          double increment_rad, double speed_rad_s) const {
  const int dof = static_cast<int>(model_.dof);
  if (articulation < 0 || articulation >= dof) {
    return bad_parameter("articulation", articulation, 0.0, dof - 1,
                         fmt::format("articulation {}, allowed 0 to {}", articulation, dof - 1),
                         articulation);
  }
  const auto joint = static_cast<std::size_t>(articulation);
  const JointLimits& limits = model_.joints[joint];
  const double present = start.position_rad[joint];
  if (!std::isfinite(increment_rad)) {
    return bad_parameter("increment", increment_rad, limits.lower_rad - present, limits.upper_rad - present,
                         "the increment is not a finite number", articulation);
  }
  Speeds speeds = scaled_speeds(model_, settings);
  if (!std::isfinite(speed_rad_s) || speed_rad_s <= 0.0) {
    return bad_parameter("speed", speed_rad_s, 0.0, speeds[joint],
                         fmt::format("speed {:.6g} degrees/s, allowed above 0 to {:.6g} degrees/s",
                                     to_degrees(speed_rad_s), to_degrees(speeds[joint])),
                         articulation);
  }
  // Degrees make the round trip to radians with a rounding, so the limit itself must pass.
  if (speed_rad_s > speeds[joint] * (1.0 + 1e-12)) {
    PlanRefusal refusal;
    refusal.kind = PlanRefusal::Kind::kLimitExceeded;
    refusal.parameter = "speed";
    refusal.articulation = articulation;
    refusal.value = speed_rad_s;
    refusal.upper = speeds[joint];
    refusal.text = fmt::format("speed {:.6g} degrees/s of articulation {}, allowed up to {:.6g} degrees/s",
                               to_degrees(speed_rad_s), articulation, to_degrees(speeds[joint]));
    return refusal;
  }
  Joints target = start.position_rad;
  target[joint] += increment_rad;
  if (!in_range(limits, target[joint])) return joint_range(articulation, target[joint], limits, "at the end");
  speeds[joint] = std::min(speeds[joint], speed_rad_s);
  return joint_command(model_, speeds, start, target, 0.0);
}

PlanResult Planner::dwell(const PlanStart& start, double t_s) const {
  if (auto refusal = check_time(t_s)) return *refusal;
  Command command = blank_command(MotionKind::kDwell, start);
  command.dwell.duration_s = t_s;
  command.duration_s = t_s;
  return std::vector<Command>{command};
}

PlanResult Planner::gripper(const PlanStart& start, double opening) const {
  if (!(opening >= 0.0 && opening <= 1.0)) {
    return bad_parameter("opening", opening, 0.0, 1.0,
                         fmt::format("opening {:.6g}, allowed 0 to 1", opening));
  }
  // A full travel shared out evenly among jerk, acceleration and cruise lasts travel_s; its peaks are the
  // limits under which a part of the travel is planned.
  const double eighth_s = model_.gripper.travel_s / 8.0;
  const LawPeaks full = peaks({1.0, eighth_s, eighth_s, 2.0 * eighth_s});
  Command command = blank_command(MotionKind::kGripper, start);
  command.gripper.from = start.gripper;
  command.gripper.law = plan_law(opening - start.gripper, {full.velocity, full.acceleration, full.jerk});
  command.duration_s = command.gripper.law.duration_s();
  return std::vector<Command>{command};
}

}  // namespace corbot
