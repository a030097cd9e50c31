// SPDX-License-Identifier: Apache-2.0
#include "planner/reasons.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "corbot/kinematics/path_form.h"
#include "corbot/motion/path.h"
#include "planner/frame_settings.h"
#include "planner/rate/rate_planner.h"
#include "planner/time_law_planner.h"

namespace corbot::rate {
namespace {

constexpr int kSamples = 1000;
constexpr double kShortestStretch = 0.01;  // of the duration
constexpr double kShareRounding = 1.0001;  // of a duration

struct Found {
  Reason reason;
  double share{-1.0};

  void take(const Reason& other, double amount, double limit) noexcept {
    const double other_share = std::abs(amount) / limit;
    if (other_share > share) *this = {other, other_share};
  }
};

/// Returns the first three derivatives of z by time.
std::array<State, 3> derivatives(std::span<const Knot> knots, const RateState& at) noexcept {
  const std::size_t k = cell_at(knots, at.lambda_s);
  const Cell cell(knots[k], knots[k + 1]);
  const double t = std::clamp((at.lambda_s - knots[k].lambda_s) / cell.length_s(), 0.0, 1.0);
  const State z1 = cell.at(t, 1), z2 = cell.at(t, 2), z3 = cell.at(t, 3);
  std::array<State, 3> by_time{};
  for (std::size_t i = 0; i <= kPath; ++i) {
    by_time[0][i] = z1[i] * at.v;
    by_time[1][i] = z2[i] * at.v * at.v + z1[i] * at.a;
    by_time[2][i] = z3[i] * at.v * at.v * at.v + 3.0 * z2[i] * at.v * at.a + z1[i] * at.j;
  }
  return by_time;
}

/// Limits of one motion. `turns` says for speed, acceleration and jerk whether the tool's rotation determines
/// the limit of s.
struct Judge {
  Limits limits;
  std::array<bool, 3> turns{};
  std::size_t dof{};

  [[nodiscard]] Found greatest(const std::array<State, 3>& z) const noexcept {
    Found found;
    const std::array<const State*, 3> most{&limits.speed, &limits.acceleration, &limits.jerk};
    for (std::size_t order = 0; order < 3; ++order) {
      const auto kind = static_cast<LimitKind>(order);
      for (std::size_t i = 0; i < dof; ++i)
        found.take({Mover::kJoint, i, kind}, z[order][i], (*most[order])[i]);
      found.take({turns[order] ? Mover::kToolTurn : Mover::kToolTravel, 0, kind}, z[order][kPath],
                 (*most[order])[kPath]);
    }
    if (const double w = limits.angle_rad; w > 0.0) {
      const double p1 = z[0][kPath], p2 = z[1][kPath], p3 = z[2][kPath];
      found.take({Mover::kToolTravel, 0, LimitKind::kAcceleration}, std::hypot(p2, w * p1 * p1),
                 limits.arc_acceleration);
      found.take({Mover::kToolTravel, 0, LimitKind::kJerk},
                 std::hypot(p3 - w * w * p1 * p1 * p1, 3.0 * w * p1 * p2), limits.arc_jerk);
    }
    return found;
  }
};

template <class Motion>
Judge judge_of(const ArmModel& model, const PlanSettings& settings, const Motion& motion) {
  Judge judge{reserved(limits_of(model, settings, motion)), {}, model.dof};
  const double length = length_m(motion), rotation = rotation_rad(motion.tool);
  const PathLimits& path = model.path;
  const auto turns = [&](double travel, double turn) { return rotation * travel > length * turn; };
  judge.turns = {turns(path.speed_m_s, path.rotation_speed_rad_s),
                 turns(path.acceleration_m_s2, path.rotation_acceleration_rad_s2),
                 turns(path.jerk_m_s3, path.rotation_jerk_rad_s3)};
  // On an arc these limits are those of the rotation alone.
  if (judge.limits.angle_rad > 0.0) judge.turns[1] = judge.turns[2] = true;
  return judge;
}

void append(std::vector<ReasonStretch>& all, const ReasonStretch& next) {
  if (all.empty() || !(all.back().reason == next.reason)) {
    all.push_back(next);
    return;
  }
  all.back().end_s = next.end_s;
  all.back().end_path = next.end_path;
  all.back().share = std::max(all.back().share, next.share);
}

double duration_of(const ReasonStretch& stretch) noexcept { return stretch.end_s - stretch.begin_s; }

/// Merges the shortest stretch into its longer neighbour until none is too short.
void drop_short(std::vector<ReasonStretch>& all, double shortest_s) {
  const auto is_shorter = [](const auto& a, const auto& b) { return duration_of(a) < duration_of(b); };
  while (all.size() > 1) {
    const auto least = std::min_element(all.begin(), all.end(), is_shorter);
    if (duration_of(*least) >= shortest_s) return;
    const bool is_first = least == all.begin(), is_last = std::next(least) == all.end();
    const bool to_next =
        is_first || (!is_last && duration_of(*std::next(least)) > duration_of(*std::prev(least)));
    const Reason& kept = to_next ? std::next(least)->reason : std::prev(least)->reason;
    least->share = 0.0;
    least->reason = kept;
    std::vector<ReasonStretch> merged;
    for (const ReasonStretch& stretch : all) append(merged, stretch);
    all = std::move(merged);
  }
}

}  // namespace

std::vector<ReasonStretch> reasons_of(const ArmModel& model, const PlanSettings& settings,
                                      const Command& command, const PlannedRate& rate) {
  const Judge judge = command.kind == MotionKind::kArc ? judge_of(model, settings, command.arc)
                                                       : judge_of(model, settings, command.line);
  const RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
  const double step_s = law.duration_s / kSamples;
  const auto path_at = [&](double t_s) { return state_at(rate.knots, law.at(t_s).lambda_s)[kPath]; };
  std::vector<ReasonStretch> all;
  for (int k = 0; k < kSamples; ++k) {
    const double begin_s = k * step_s, end_s = (k + 1) * step_s;
    const Found found = judge.greatest(derivatives(rate.knots, law.at(begin_s + 0.5 * step_s)));
    append(all, {found.reason, begin_s, end_s, path_at(begin_s), path_at(end_s), found.share});
  }
  drop_short(all, kShortestStretch * law.duration_s);
  return all;
}

std::optional<Reason> reason_of(const ArmModel& model, const PlanSettings& settings, const Command& command) {
  Reason reason;
  double longest_s = 0.0;
  for (std::size_t i = 0; i < model.dof; ++i) {
    const JointLimits& limits = model.joints[i];
    const double speed_q_s = limits.speed_q_s * settings.speed_ratio * settings.joint_speed_ratio[i];
    const TimeLaw law =
        plan_law(command.joint.law[i].distance, {speed_q_s, limits.acceleration_q_s2, limits.jerk_q_s3});
    if (law.duration_s() <= longest_s) continue;
    longest_s = law.duration_s();
    reason = {Mover::kJoint, i,
              law.t_cruise_s > 0.0 ? LimitKind::kSpeed
              : law.t_acc_s > 0.0  ? LimitKind::kAcceleration
                                   : LimitKind::kJerk};
  }
  if (longest_s == 0.0 || command.duration_s > kShareRounding * longest_s) return std::nullopt;
  return reason;
}

std::optional<NearestSingularity> nearest_singularity(const ArmModel& model, const Command& command,
                                                      std::span<const Knot> knots) {
  if (task_matrix(model.kinematics, {}).rows != model.dof) return std::nullopt;
  const auto pivot = [&](const Knot& knot) {
    Joints q{};
    std::copy_n(knot.z.begin(), q.size(), q.begin());
    return least_pivot(model.kinematics, q);
  };
  NearestSingularity nearest{pivot(knots.front()), knots.front().z[kPath], {}};
  for (const Knot& knot : knots.subspan(1)) {
    if (const double other = pivot(knot); other < nearest.pivot) nearest = {other, knot.z[kPath], {}};
  }
  nearest.point_m = command.kind == MotionKind::kArc ? point_at(command.arc, nearest.path).position_m
                                                     : point_at(command.line, nearest.path).position_m;
  return nearest;
}

std::vector<PlanPart> parts_of(const ArmModel& model, const PlanSettings& settings, const PlanResult& plan) {
  const auto* commands = std::get_if<std::vector<Command>>(&plan);
  if (commands == nullptr) return {};
  ArmModel framed = model;
  framed.kinematics = in_frames(model.kinematics, settings);
  std::vector<PlanPart> parts;
  for (std::size_t k = 0; k < commands->size(); ++k) {
    const Command& command = (*commands)[k];
    const bool is_joint = command.kind == MotionKind::kJoint;
    const bool is_path = command.kind == MotionKind::kLine || command.kind == MotionKind::kArc;
    PlanPart& part = parts.emplace_back();
    part.duration_s = command.duration_s;
    part.moves_arm = is_joint || is_path;
    if (is_path && k < plan.rates.size() && !plan.rates[k].pieces.empty()) {
      part.stretches = reasons_of(framed, settings, command, plan.rates[k]);
      part.nearest = nearest_singularity(framed, command, plan.rates[k].knots);
    } else if (const auto reason = is_joint ? reason_of(framed, settings, command) : std::nullopt) {
      part.stretches = {{*reason, 0.0, command.duration_s, 0.0, 1.0, 1.0}};
    }
  }
  return parts;
}

}  // namespace corbot::rate
