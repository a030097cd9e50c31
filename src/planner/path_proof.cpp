// SPDX-License-Identifier: Apache-2.0
#include "planner/path_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "corbot/motion/path_joints.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestCell = 1e-9;       // of the path parameter
constexpr double kSmallestTravel_m = 1e-12;  // of TCP and tool together
constexpr std::size_t kMostCells = 20'000;   // a path that needs more runs along a border and is refused
/// A larger change in a smallest cell is a jump, which the set-point check would refuse. At a border joints
/// change by about √kSmallestCell.
constexpr double kUnbroken_rad = 1e-3;
constexpr double kMostJump_rad = 4.0;     // a singularity makes joints jump by half a turn at most
constexpr double kWrapMargin_rad = 1e-6;  // distance from the ends of a turn, at which joints wrap

struct Interval {
  double a, b;
};

/// Returns the lever by which a rotation of the tool counts as travel, m per rad. It is the distance of the
/// tool centre point from the last axis. It is at least a hand's size, as the wrist moves about a centre
/// point at rest.
double hand_m(const JointChain& chain) {
  constexpr double kLeast_m = 0.1;
  if (chain.count == 0) return kLeast_m;
  const JointAxis& last = chain.axes[chain.count - 1];
  return std::max(kLeast_m,
                  norm(cross(last.direction, (chain.zero_T_n * chain.n_T_tool).position_m - last.point_m)));
}

}  // namespace

PathProof::PathProof(const ArmModel& model, const LineMotion& line, const Joints& start_q,
                     const std::optional<JointRanges>& soft_limits)
    : model_(&model), path_(line), solution_(line.solution), start_q_(start_q), ranges_(model.joints) {
  constants_.turn_rad = turn_of(line.tool);
  constants_.bend_m = 0.0;
  constants_.travel_m = length_m(line) + hand_m(model.kinematics.chain()) * rotation_rad(line.tool);
  cut_limits(soft_limits);
}

PathProof::PathProof(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
                     const std::optional<JointRanges>& soft_limits)
    : model_(&model), path_(arc), solution_(arc.solution), start_q_(start_q), ranges_(model.joints) {
  constants_.turn_rad = turn_of(arc.tool);
  constants_.bend_m = arc.radius_m * arc.angle_rad * arc.angle_rad;
  constants_.travel_m = length_m(arc) + hand_m(model.kinematics.chain()) * rotation_rad(arc.tool);
  cut_limits(soft_limits);
}

void PathProof::cut_limits(const std::optional<JointRanges>& soft_limits) noexcept {
  constexpr double kHalfTurn = std::numbers::pi - kWrapMargin_rad;
  const auto narrow = [](JointLimits& limits, double lower_q, double upper_q) {
    limits.lower_q = std::max(limits.lower_q, lower_q);
    limits.upper_q = std::min(limits.upper_q, upper_q);
  };
  for (std::size_t i = 0; i < model_->dof; ++i) {
    if (soft_limits) narrow(ranges_[i], soft_limits->lower_q[i], soft_limits->upper_q[i]);
    limits_[i] = ranges_[i];
    if (model_->kinematics.joint_kind(i) != JointKind::kRotary) continue;
    const double middle_q = middle_of_turn(model_->joints[i], start_q_[i]);
    narrow(limits_[i], middle_q - kHalfTurn, middle_q + kHalfTurn);
  }
}

bool PathProof::is_cut_by_turn(std::size_t joint, double position_q) const noexcept {
  const JointLimits& kept = limits_[joint];
  const JointLimits& range = ranges_[joint];
  const bool above = position_q > 0.5 * (kept.lower_q + kept.upper_q);
  const double beyond = above ? range.upper_q - kept.upper_q : kept.lower_q - range.lower_q;
  return beyond > 2.0 * kWrapMargin_rad;
}

PlanRefusal PathProof::leaves_range(std::size_t joint, double position_q, double s) const {
  const JointKind kind = model_->kinematics.joint_kind(joint);
  const bool by_turn = is_cut_by_turn(joint, position_q);
  PlanRefusal refusal = joint_range(joint, kind, by_turn ? position_q : shown(joint, position_q),
                                    limits_[joint], fmt::format("{:.3g} % along the path", 100.0 * s));
  refusal.target_m = point(s).position_m;
  if (by_turn)
    refusal.text += fmt::format(
        "; its range is wider, but one such path keeps a joint within half a turn of {}: divide the path",
        shown_joint(kind, middle_of_turn(model_->joints[joint], start_q_[joint])));
  return refusal;
}

double PathProof::shown(std::size_t joint, double value_q) const noexcept {
  return model_->kinematics.joint_kind(joint) == JointKind::kRotary ? wrap_angle(value_q) : value_q;
}

PathPoint PathProof::point(double s) const noexcept {
  return std::visit([s](const auto& path) { return point_at(path, s); }, path_);
}

std::array<double, 3> PathProof::derivative(double s) const noexcept {
  return std::visit([s](const auto& path) { return velocity_at(path, s); }, path_);
}

IkSolution PathProof::joints_at(double s) const noexcept {
  return corbot::joints_at(*model_, point(s), solution_, start_q_);
}

bool PathProof::is_smallest(double s_a, double s_b) const noexcept {
  return s_b - s_a <= kSmallestCell || (s_b - s_a) * constants_.travel_m <= kSmallestTravel_m;
}

PathProof::Cell PathProof::bound(double s_a, double s_b) const noexcept {
  const double s = 0.5 * (s_a + s_b);
  const PathPoint p = point(s);
  Cell cell;
  cell.middle = joints_at(s);
  cell.rates.rate_bound.fill(kInfinity);
  if (cell.middle.status != IkStatus::kOk) return cell;
  cell.rates = cell_rates(
      model_->kinematics, cell.middle.joints_q, solution_,
      {p.position_m, derivative(s), constants_.bend_m, p.angles_rad, constants_.turn_rad, 0.5 * (s_b - s_a)});
  return cell;
}

std::optional<PlanRefusal> PathProof::check_ends(double s_a, double s_b) const {
  const IkSolution a = joints_at(s_a);
  const IkSolution b = joints_at(s_b);
  for (const IkSolution* end : {&a, &b}) {
    if (end->status != IkStatus::kOk) {
      return unreachable(point(end == &a ? s_a : s_b).position_m, *end, "the path's point");
    }
  }
  for (std::size_t i = 0; i < model_->dof; ++i) {
    const double jump_q = std::abs(a.joints_q[i] - b.joints_q[i]);
    // On its axis the first joint is free and takes the hint's value. A path that leaves the axis in the
    // arm's own direction is unbroken.
    if (jump_q <= kUnbroken_rad) continue;
    // If a joint is fast, a smallest cell can step over the whole margin at the end of a turn. The jump is
    // then a wrap, not travel.
    if (i != 0 && jump_q > kMostJump_rad) {
      const bool above = a.joints_q[i] > b.joints_q[i];
      return leaves_range(i, above ? limits_[i].upper_q : limits_[i].lower_q, s_a);
    }
    PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "P", Quantity::kNumber);
    refusal.joint = static_cast<int>(i);
    refusal.target_m = point(s_b).position_m;
    refusal.text =
        i == 0 ? fmt::format("the path leads through the base axis at z = {:.6g} m, where joint 0 would jump",
                             refusal.target_m[2])
               : fmt::format(
                     "the path leads through a singularity at ({:.6g}, {:.6g}, {:.6g}) m, where joint {} "
                     "would jump by {}",
                     refusal.target_m[0], refusal.target_m[1], refusal.target_m[2], i,
                     shown_joint(model_->kinematics.joint_kind(i), jump_q));
    return refusal;
  }
  return std::nullopt;
}

std::optional<PlanRefusal> PathProof::singularity_before(double s) const {
  const auto is_within = [&](double at) {
    const IkSolution there = joints_at(at);
    if (there.status != IkStatus::kOk) return false;
    for (std::size_t i = 0; i < model_->dof; ++i) {
      if (!in_range(limits_[i], there.joints_q[i])) return false;
    }
    return true;
  };
  double within = 0.0;
  if (!is_within(within)) return std::nullopt;
  while (!is_smallest(within, s)) {
    const double middle = 0.5 * (within + s);
    (is_within(middle) ? within : s) = middle;
  }
  auto refusal = check_ends(within, s);
  const bool jumps = refusal && refusal->kind == PlanRefusal::Kind::kUnreachable && refusal->joint >= 0;
  return jumps ? refusal : std::nullopt;
}

std::optional<PlanRefusal> PathProof::check_geometry() const {
  std::vector<Interval> open{{0.0, 1.0}};
  for (std::size_t count = 0; !open.empty(); ++count) {
    const auto [s_a, s_b] = open.back();
    open.pop_back();
    const Cell cell = bound(s_a, s_b);
    const double s = 0.5 * (s_a + s_b);
    if (cell.middle.status != IkStatus::kOk)
      return unreachable(point(s).position_m, cell.middle, "the path's point");
    bool proved = cell.rates.in_reach;
    for (std::size_t i = 0; i < model_->dof; ++i) {
      const JointLimits& limits = limits_[i];
      const double q = cell.middle.joints_q[i];
      if (!in_range(limits, q)) {
        if (auto singular = singularity_before(s)) return singular;
        return leaves_range(i, q, s);
      }
      const double stray = cell.rates.rate_bound[i] * 0.5 * (s_b - s_a);
      proved = proved && in_range(limits, q - stray) && in_range(limits, q + stray);
    }
    if (proved) continue;
    if (is_smallest(s_a, s_b)) {
      if (auto refusal = check_ends(s_a, s_b)) return refusal;
      continue;
    }
    if (count >= kMostCells) {
      PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, "path", Quantity::kNumber);
      refusal.target_m = point(s).position_m;
      refusal.text = "the path runs along the border of the workspace too closely to be proved within it";
      return refusal;
    }
    open.push_back({s, s_b});
    open.push_back({s_a, s});
  }
  return std::nullopt;
}

}  // namespace corbot
