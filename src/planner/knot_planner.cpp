// SPDX-License-Identifier: Apache-2.0
#include "planner/knot_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "corbot/kinematics/path_form.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/numeric/path_function.h"
#include "planner/numeric/tracking.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

using numeric::PathFunction;
using numeric::Tracking;

// Far below what is allowed: so the tool's acceleration and jerk are the path's, too, within what path_planner.cpp keeps in reserve.
// The second is for paths that would need too many pieces: they creep past a singularity.
constexpr double kWanted[] = {1e-9, 1e-7};
constexpr double kFirstLength = 1.0 / 8.0;
constexpr double kLongest = 1.0 / 4.0;
constexpr double kShortest = 1e-6;  // a piece that must be shorter is next to a singularity
constexpr double kOrder = 6.0;      // the error of a piece is as its length to this power

class KnotPlanner {
 public:
  KnotPlanner(const ArmModel& model, const PathFunction& path)
      : arm_(model.kinematics), path_(path), tracking_(model, path) {}

  /// Each piece within `wanted` at a few points.
  KnotPlan plan(const Joints& start_q, double wanted) {
    are_too_many_ = false;
    std::optional<PathKnot> first = knot(0.0, start_q);
    if (!first)
      return refused(0.0, "from where this arm cannot follow a line or an arc, being at a singularity");
    std::vector<PathKnot> knots{*first};
    double length = kFirstLength;
    while (knots.back().s < 1.0) {
      const PathKnot& last = knots.back();
      const double left = 1.0 - last.s;
      const double s = left <= length ? 1.0 : last.s + std::min(length, 0.5 * left);  // no tiny rest
      const std::optional<PathKnot> next = follow(last, s);
      const double error = next ? tracking_.sampled(KnotPiece(last, *next)) : 1.0;
      const double factor = 0.9 * std::pow(wanted / std::max(error, 1e-3 * wanted), 1.0 / kOrder);
      if (!(error <= wanted) || !tracking_.proves(KnotPiece(last, *next))) {
        length = (s - last.s) * std::clamp(factor, 0.2, 0.8);
        if (length < kShortest)
          return refused(last.s,
                         "beyond which the path leaves the arm's reach, or leads through a singularity");
        continue;
      }
      are_too_many_ = knots.size() == kMostKnots;
      if (are_too_many_)
        return refused(last.s,
                       fmt::format("up to where it needs {} pieces, the most there can be: make it shorter",
                                   kMostKnots));
      length = std::min(kLongest, (s - last.s) * std::clamp(factor, 0.5, 4.0));
      knots.push_back(*next);
    }
    return knots;
  }
  [[nodiscard]] bool are_too_many() const noexcept { return are_too_many_; }

 private:
  [[nodiscard]] TaskRate task_rate(double s) const noexcept {
    const Vector3 v = path_.velocity_m(s);
    TaskRate rate{v[0], v[1], v[2]};
    for (std::size_t k = 0; k < 3; ++k) rate[3 + k] = path_.turn_rad()[k];
    return rate;
  }

  /// M(q)·rate_q.
  [[nodiscard]] TaskRate moved(const Joints& q, const Joints& rate_q) const noexcept {
    const Jacobian jacobian = arm_.jacobian(q);
    TaskRate rate{};
    // Those of angles do not change.
    const std::size_t rows = arm_.follows() == Follows::kFull ? 6 : 3;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t i = 0; i < arm_.joint_count(); ++i) rate[k] += jacobian[k][i] * rate_q[i];
    }
    return rate;
  }

  /// Nothing at a singularity. q″ from M q″ = x″ − M′ q′, where M′ is a difference of M along q′.
  [[nodiscard]] std::optional<PathKnot> knot(double s, const Joints& q) const noexcept {
    constexpr double kStep_q = 1e-4;
    const PathForm form(arm_, q);
    if (!form.is_regular()) return std::nullopt;
    PathKnot knot{s, q, form.bound(task_rate(s), {}, 0.0).rate_middle, {}};
    double fastest = 0.0;
    for (const double rate : knot.rate_q) fastest = std::max(fastest, std::abs(rate));
    if (!std::isfinite(fastest)) return std::nullopt;
    const double step = fastest > 0.0 ? kStep_q / fastest : 1.0;
    Joints before = q, after = q;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      before[i] -= step * knot.rate_q[i];
      after[i] += step * knot.rate_q[i];
    }
    const TaskRate a = moved(before, knot.rate_q), b = moved(after, knot.rate_q);
    const Vector3 bend = path_.bend_m(s);
    TaskRate left{};
    for (std::size_t k = 0; k < left.size(); ++k)
      left[k] = (k < 3 ? bend[k] : 0.0) - (b[k] - a[k]) / (2.0 * step);
    knot.bend_q = form.bound(left, {}, 0.0).rate_middle;
    return knot;
  }

  /// From one knot to another, on the same solution.
  [[nodiscard]] std::optional<PathKnot> follow(const PathKnot& last, double s) const noexcept {
    const double h = s - last.s;
    Joints q = last.q;
    for (std::size_t i = 0; i < kMaxJoints; ++i) q[i] += h * (last.rate_q[i] + 0.5 * h * last.bend_q[i]);
    const PathPoint point = path_.point(s);
    if (!numeric::refine(arm_, point, q)) return std::nullopt;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      if (!(std::abs(q[i] - last.q[i]) <= kLongestPiece_q)) return std::nullopt;
    }
    return knot(s, q);
  }

  [[nodiscard]] PlanRefusal refused(double s, const std::string& why) const {
    PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "P", Quantity::kNumber);
    refusal.target_m = path_.point(s).position_m;
    refusal.text = fmt::format("the path can be followed to ({:.6g}, {:.6g}, {:.6g}) m, {:.3g} % of it, {}",
                               refusal.target_m[0], refusal.target_m[1], refusal.target_m[2], 100.0 * s, why);
    return refusal;
  }

  const Kinematics& arm_;
  const PathFunction& path_;
  Tracking tracking_;
  bool are_too_many_{};
};

KnotPlan plan(const ArmModel& model, const PathFunction& path, const Joints& start_q) {
  if (model.dof < 3) return follows_no_path(model.dof, path.point(1.0).position_m);
  KnotPlanner planner(model, path);
  KnotPlan result = planner.plan(start_q, kWanted[0]);
  return planner.are_too_many() ? planner.plan(start_q, kWanted[1]) : result;
}

}  // namespace

KnotPlan plan_knots(const ArmModel& model, const LineMotion& line, const Joints& start_q) {
  return plan(model, PathFunction(line), start_q);
}
KnotPlan plan_knots(const ArmModel& model, const ArcMotion& arc, const Joints& start_q) {
  return plan(model, PathFunction(arc), start_q);
}

}  // namespace corbot
