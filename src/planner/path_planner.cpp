// SPDX-License-Identifier: Apache-2.0
#include "planner/path_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "corbot/motion/bounds.h"
#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path_joints.h"
#include "corbot/motion/tool_peaks.h"
#include "planner/knot_planner.h"
#include "planner/plan/refusal.h"
#include "planner/rate/ranges.h"
#include "planner/rate/rate_planner.h"
#include "planner/time_law_planner.h"
#include "planner/tool_goal.h"

namespace corbot {
namespace {

constexpr double kNoTravel = 1e-30;      // metres and radians; below it there is nothing to run through
constexpr double kRoundUp = 1.0 + 1e-9;  // of a stretch, over rounding

/// A rotary joint's value as people read it.
double within_turn(JointKind kind, double value_q) {
  return kind == JointKind::kRotary ? wrap_angle(value_q) : value_q;
}

double per(double limit, double amount) {
  return amount > kNoTravel ? limit / amount : std::numeric_limits<double>::infinity();
}

double curvature_1_m(const LineMotion&) { return 0.0; }
double curvature_1_m(const ArcMotion& arc) { return 1.0 / arc.radius_m; }

/// The time-optimal law under the path's own limits and a cap on ṡ. On an arc the acceleration that counts is
/// the vector's, and likewise the jerk (tool_peaks). The cap on the speed leaves room for the tangential parts;
/// what is still too much is stretched away.
TimeLaw path_law(const PathLimits& limits, double speed_ratio, const PathScale& scale, double rate_cap) {
  double v = limits.speed_m_s * speed_ratio;
  double a = limits.acceleration_m_s2;
  const double k = scale.curvature_1_m;
  if (k > 0.0) {
    v = std::min({v, std::sqrt(0.8 * a / k), std::cbrt(0.5 * limits.jerk_m_s3 / (k * k))});
    a = std::sqrt((a - k * v * v) * (a + k * v * v));
  }
  const LawLimits law_limits{
      std::min({per(v, scale.length_m), per(limits.rotation_speed_rad_s * speed_ratio, scale.rotation_rad),
                rate_cap}),
      std::min(per(a, scale.length_m), per(limits.rotation_acceleration_rad_s2, scale.rotation_rad)),
      std::min(per(limits.jerk_m_s3, scale.length_m), per(limits.rotation_jerk_rad_s3, scale.rotation_rad))};
  TimeLaw law = plan_law(1.0, law_limits);
  if (k > 0.0) {
    const ToolPeaks tool = tool_peaks(peaks(law), scale.length_m, k);
    const double factor = std::max({1.0, std::sqrt(tool.acceleration_m_s2 / limits.acceleration_m_s2),
                                    std::cbrt(tool.jerk_m_s3 / limits.jerk_m_s3)});
    if (factor > 1.0) law = stretch(law, law.duration_s() * factor * kRoundUp);
  }
  return law;
}

/// Pieces between knots have a shape of their own: this is left to them of the tool's speed, acceleration and jerk.
PathLimits reserved(PathLimits limits) {
  constexpr double kSpeed = 1.0 - 1e-4;
  constexpr double kAcceleration = 1.0 - 2e-3;
  constexpr double kJerk = 1.0 - 3e-2;
  limits.speed_m_s *= kSpeed;
  limits.acceleration_m_s2 *= kAcceleration;
  limits.jerk_m_s3 *= kJerk;
  limits.rotation_speed_rad_s *= kSpeed;
  limits.rotation_acceleration_rad_s2 *= kAcceleration;
  limits.rotation_jerk_rad_s3 *= kJerk;
  return limits;
}

}  // namespace

PathPlanner::PathPlanner(const ArmModel& model, const ArmModel& whole, const PlanSettings& settings,
                         PathTiming timing)
    : model_(model), whole_(whole), settings_(settings), timing_(timing) {
  for (std::size_t i = 0; i < model.dof; ++i)
    joint_speed_[i] = model.joints[i].speed_q_s * settings.joint_speed_ratio[i];
}

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

/// The solutions that the arm is on, by a round trip: one, but where two of them meet either may lead on. The smallest number
/// comes first.
std::vector<std::uint32_t> PathPlanner::present_solutions(const PathPoint& here, const Joints& q) const {
  const Kinematics& arm = model_.kinematics;
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t number = 0; arm.has_solution(number); ++number) {
    const IkSolution there = inverse_at(arm, here, number, q);
    if (there.status == IkStatus::kOk && arm.same(there.joints_q, q, Kinematics::kSameJoints_q)) {
      numbers.push_back(number);
    }
  }
  if (numbers.empty()) numbers.push_back(0);  // check_start will say what is wrong
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
    const bool has_rate = timing_ == PathTiming::kRate;
    PathPlan result =
        has_rate ? plan_with_rate(start, motion, t_s, member) : plan_by_law(start, motion, t_s, member);
    if (std::holds_alternative<Command>(result)) return result;
    refuse(std::get<PlanRefusal>(result));
  }
  return *first;
}

template <class Motion, class Member>
PathPlan PathPlanner::plan_by_law(const PlanStart& start, const Motion& motion, double t_s,
                                  Member member) const {
  return model_.kinematics.has_closed_form() ? plan_on_solution(start, motion, t_s, member)
                                             : plan_between_knots(start, motion, t_s, member);
}

template <class Motion, class Member>
PathPlan PathPlanner::plan_on_solution(const PlanStart& start, Motion motion, double t_s,
                                       Member member) const {
  return plan_proved(start, motion, PathProof(whole_, motion, start.position_q, {}, settings_.soft_limits),
                     t_s, member);
}

/// Without a closed form: numerically, from knot to knot.
template <class Motion, class Member>
PathPlan PathPlanner::plan_between_knots(const PlanStart& start, Motion motion, double t_s,
                                         Member member) const {
  KnotPlan plan = plan_knots(model_, motion, start.position_q);
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) return *refusal;
  auto& knots = std::get<std::vector<PathKnot>>(plan);
  motion.knots.count = static_cast<std::uint16_t>(knots.size());
  PathPlan result = plan_proved(
      start, motion, PathProof(whole_, motion, start.position_q, knots, settings_.soft_limits), t_s, member);
  if (std::holds_alternative<Command>(result)) result.knots = std::move(knots);
  return result;
}

/// At every limit of every joint. Without travel it is a dwell. A path along a singularity, and one of nanometres beside
/// one, has no knots in lambda; a law serves there, and its refusals name point and joint.
template <class Motion, class Member>
PathPlan PathPlanner::plan_with_rate(const PlanStart& start, Motion motion, double t_s, Member member) const {
  const PathPoint target = point_at(motion, 1.0);
  rate::RatePlanned planned = rate::plan_rate(whole_, settings_, motion, start.position_q, t_s);
  if (std::holds_alternative<PlanRefusal>(planned)) return plan_by_law(start, motion, t_s, member);
  auto& plan = std::get<rate::RatePlan>(planned);
  if (auto refusal = check_ranges(plan.knots, target)) return *refusal;
  Command command = blank_command(MotionKind::kDwell, start);
  command.duration_s = plan.law.duration_s();
  if (!(command.duration_s <= kLongestPlan_s)) return too_long(command.duration_s);
  if (plan.law.length_s() == 0.0) {
    command.dwell.duration_s = command.duration_s;
    return command;
  }
  std::copy_n(plan.knots.back().z.begin(), kMaxJoints, command.end_q.begin());
  motion.law = {};
  motion.knots = {0, static_cast<std::uint16_t>(plan.knots.size()),
                  static_cast<std::uint16_t>(plan.law.pieces().size())};
  member(command) = motion;
  PathPlan result = command;
  result.rate = {std::move(plan.knots), plan.law.pieces()};
  return result;
}

/// Of a path between knots, the target first, as in check_ends().
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

template <class Motion, class Member>
PathPlan PathPlanner::plan_proved(const PlanStart& start, Motion motion, const PathProof& proof, double t_s,
                                  Member member) const {
  const PathScale scale{length_m(motion), rotation_rad(motion.tool), curvature_1_m(motion)};
  if (auto refusal = check_ends(start, proof, point_at(motion, 1.0))) return *refusal;
  const IkSolution end = proof.joints_at(1.0);
  Command command = blank_command(MotionKind::kLine, start);
  std::copy_n(end.joints_q.begin(), model_.dof, command.end_q.begin());
  if (scale.length_m > kNoTravel || scale.rotation_rad > kNoTravel) {
    if (auto refusal = proof.check_geometry()) return *refusal;
    motion.law = fastest_law(proof, scale);
  } else {
    motion.law = {};
    command.end_q = start.position_q;
  }
  const double shortest_s = motion.law.duration_s();
  command.duration_s = std::max(shortest_s, t_s);
  if (!(command.duration_s <= kLongestPlan_s)) return too_long(command.duration_s);
  if (t_s > shortest_s) motion.law = stretch(motion.law, t_s);
  member(command) = motion;
  return command;
}

/// The ends of a path.
std::optional<PlanRefusal> PathPlanner::check_ends(const PlanStart& start, const PathProof& proof,
                                                   const PathPoint& target) const {
  // The target first: of all points that may be out of reach it is the one that the caller has given.
  const IkSolution end = proof.joints_at(1.0);
  if (end.status != IkStatus::kOk) return unreachable(target.position_m, end, "the target");
  if (auto refusal = check_start(start, proof.joints_at(0.0))) return *refusal;
  for (std::size_t i = 0; i < model_.dof; ++i) {
    if (in_range(model_.joints[i], end.joints_q[i])) continue;
    if (auto singular = proof.singularity_before(1.0)) return *singular;
    return range_at_target(i, end.joints_q[i], target);
  }
  return std::nullopt;
}

/// The path must begin where the arm rests, as the real-time task will see it.
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

/// Two ways to respect the joints' speeds: run the whole law more slowly, or cap its cruise. Where the
/// joints are fast only briefly at the ends the first is the shorter one, where they are fast midway the
/// second is.
TimeLaw PathPlanner::fastest_law(const PathProof& proof, const PathScale& scale) const {
  const PathLimits limits = model_.kinematics.has_closed_form() ? model_.path : reserved(model_.path);
  const TimeLaw free =
      path_law(limits, settings_.speed_ratio, scale, std::numeric_limits<double>::infinity());
  const double load = proof.load(free, joint_speed_, 1.0);
  if (load <= 1.0) return free;
  const double stretched_s = free.duration_s() * load * kRoundUp;
  // A capped law lasts at least 1/cap, so a load that makes this longer than the stretched law settles it.
  const double unit_load = proof.unit_load(joint_speed_, stretched_s);
  if (std::isfinite(unit_load)) {
    const TimeLaw capped = path_law(limits, settings_.speed_ratio, scale, 1.0 / (unit_load * kRoundUp));
    if (capped.duration_s() < stretched_s) return capped;
  }
  return stretch(free, stretched_s);
}

}  // namespace corbot
