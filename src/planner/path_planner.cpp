// SPDX-License-Identifier: Apache-2.0
#include "planner/path_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/motion/bounds.h"
#include "corbot/motion/path_joints.h"
#include "planner/plan/refusal.h"
#include "planner/rate/ranges.h"
#include "planner/rate/rate_planner.h"
#include "planner/tool_goal.h"
#include "planner/workspace_proof.h"

namespace corbot {
namespace {

/// Returns a rotary joint's value within half a turn of 0, for texts.
double within_turn(JointKind kind, double value_q) {
  return kind == JointKind::kRotary ? wrap_angle(value_q) : value_q;
}

}  // namespace

PathPlan PathPlanner::line(const PlanStart& start, const std::array<double, 3>& to_m, double t_s) const {
  LineMotion line{};
  line.from_m = model_.kinematics.forward(start.position_q).position_m;
  line.to_m = to_m;
  return plan(start, line, t_s, [](Command& command) -> LineMotion& {
    command.kind = MotionKind::kLine;
    return command.line;
  });
}

PathPlan PathPlanner::arc(const PlanStart& start, ArcMotion arc) const {
  return plan(start, arc, 0.0, [](Command& command) -> ArcMotion& {
    command.kind = MotionKind::kArc;
    return command.arc;
  });
}

/// Returns the numbers of the arm's present solutions, found by a round trip, in ascending order. There is
/// one, but where two solutions meet the path may continue on either.
std::vector<std::uint32_t> PathPlanner::present_solutions(const PathPoint& here, const Joints& q) const {
  const Kinematics& arm = model_.kinematics;
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t number = 0; arm.has_solution(number); ++number) {
    const IkSolution there = inverse_at(arm, here, number, q);
    if (there.status == IkStatus::kOk && arm.same(there.joints_q, q, Kinematics::kSameJoints_q)) {
      numbers.push_back(number);
    }
  }
  if (numbers.empty()) numbers.push_back(0);  // check_start reports what is wrong
  return numbers;
}

template <class Motion, class Member>
PathPlan PathPlanner::plan(const PlanStart& start, Motion motion, double t_s, Member member) const {
  const PathPoint here = present_point(model_.kinematics, start.position_q);
  const Vector3 target_m = point_at(motion, 1.0).position_m;
  motion.frames = frames_of(model_.kinematics);
  std::optional<PlanRefusal> first;
  const auto refuse = [&first](const PlanRefusal& refusal) {
    if (!first) first = refusal;
  };
  for (const std::uint32_t number : present_solutions(here, start.position_q)) {
    const auto goal = goal_point(model_, settings_, start.position_q, target_m, number);
    if (const auto* refusal = std::get_if<PlanRefusal>(&goal)) {
      refuse(*refusal);
      continue;
    }
    motion.tool = orientation_path(model_.kinematics, here, std::get<PathPoint>(goal));
    motion.solution = number;
    PathPlan result = plan_on_solution(start, motion, t_s, member);
    if (std::holds_alternative<Command>(result)) return result;
    refuse(std::get<PlanRefusal>(result));
  }
  return *first;
}

/// Plans at the limits of every joint. A motion without travel becomes a dwell.
template <class Motion, class Member>
PathPlan PathPlanner::plan_on_solution(const PlanStart& start, Motion motion, double t_s,
                                       Member member) const {
  const PathPoint target = point_at(motion, 1.0);
  rate::RatePlanned planned = rate::plan_rate(whole_, settings_, motion, start.position_q, t_s);
  if (const auto* refusal = std::get_if<PlanRefusal>(&planned))
    return closed_form_refusal(start, motion).value_or(*refusal);
  auto& plan = std::get<rate::RatePlan>(planned);
  if (auto refusal = check_ranges(plan.knots, target)) return *refusal;
  Command command = blank_command(MotionKind::kDwell, start);
  command.duration_s = plan.law.duration_s();
  if (!(command.duration_s <= kLongestPlan_s)) return too_long(command.duration_s);
  if (plan.law.length_s() == 0.0) {
    command.dwell.duration_s = command.duration_s;
    return command;
  }
  if (auto refusal = check_workspace(model_, plan.knots)) return *refusal;
  std::copy_n(plan.knots.back().z.begin(), kMaxJoints, command.end_q.begin());
  motion.knots = {0, static_cast<std::uint16_t>(plan.knots.size()),
                  static_cast<std::uint16_t>(plan.law.pieces().size())};
  member(command) = motion;
  PathPlan result = command;
  result.rate = {std::move(plan.knots), plan.law.pieces()};
  return result;
}

/// Checks the joint ranges of a path between knots, the target first, like check_ends().
std::optional<PlanRefusal> PathPlanner::check_ranges(const std::vector<rate::Knot>& knots,
                                                     const PathPoint& target) const {
  for (std::size_t i = 0; i < model_.dof; ++i) {
    const double end_q = knots.back().z[i];
    if (!in_range(model_.joints[i], end_q)) return range_at_target(i, end_q, target);
  }
  const std::optional<rate::RangeBreach> breach = rate::find_breach(knots, model_.dof, model_.joints);
  if (!breach) return std::nullopt;
  const rate::State there = rate::state_at(knots, breach->lambda_s);
  Joints there_q{};
  std::copy_n(there.begin(), there_q.size(), there_q.begin());
  const JointKind kind = model_.kinematics.joint_kind(breach->joint);
  PlanRefusal refusal = joint_range(model_, breach->joint, within_turn(kind, breach->position_q),
                                    fmt::format("{:.3g} % along the path", 100.0 * there[rate::kPath]));
  refusal.target_m = model_.kinematics.forward(there_q).position_m;
  return refusal;
}

PlanRefusal PathPlanner::range_at_target(std::size_t joint, double position_q,
                                         const PathPoint& target) const {
  const double shown_q = within_turn(model_.kinematics.joint_kind(joint), position_q);
  PlanRefusal refusal = joint_range(model_, joint, shown_q, "at the target");
  refusal.target_m = target.position_m;
  return refusal;
}

/// Returns a refusal that the closed form can explain by the joint and the point, for a path without knots.
template <class Motion>
std::optional<PlanRefusal> PathPlanner::closed_form_refusal(const PlanStart& start,
                                                            const Motion& motion) const {
  if (!model_.kinematics.has_closed_form()) return std::nullopt;
  const PathProof proof(whole_, motion, start.position_q, settings_.soft_limits);
  if (auto refusal = check_ends(start, proof, point_at(motion, 1.0))) return refusal;
  return proof.check_geometry();
}

/// Checks the ends of a path.
std::optional<PlanRefusal> PathPlanner::check_ends(const PlanStart& start, const PathProof& proof,
                                                   const PathPoint& target) const {
  // The target comes first: of all points out of reach, the caller has given this one.
  const IkSolution end = proof.joints_at(1.0);
  if (end.status != IkStatus::kOk) return unreachable(target.position_m, end, "the target");
  if (auto refusal = check_start(start, proof.joints_at(0.0))) return refusal;
  for (std::size_t i = 0; i < model_.dof; ++i) {
    if (in_range(model_.joints[i], end.joints_q[i])) continue;
    if (auto singular = proof.singularity_before(1.0)) return singular;
    return range_at_target(i, end.joints_q[i], target);
  }
  return std::nullopt;
}

/// Checks that the path begins at the arm's rest position, as the real-time task will compare it.
std::optional<PlanRefusal> PathPlanner::check_start(const PlanStart& start, const IkSolution& first) const {
  for (std::size_t i = 0; i < model_.dof; ++i) {
    const double present = start.position_q[i];
    if (first.status == IkStatus::kOk && std::abs(first.joints_q[i] - present) <= kPlannedStartTolerance_q)
      continue;
    PlanRefusal refusal = joint_range(model_, i, present, "at the start");
    refusal.text = fmt::format(
        "joint {} stands at {}, from where no line or arc can be followed (folded, or beyond "
        "half a turn from the middle of its range): move its joints first",
        i, shown_joint(model_.kinematics.joint_kind(i), present));
    return refusal;
  }
  return std::nullopt;
}

}  // namespace corbot
