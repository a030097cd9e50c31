// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "corbot/kinematics/path_form.h"
#include "corbot/motion/path_joints.h"
#include "planner/numeric/numeric_inverse.h"
#include "planner/numeric/path_function.h"
#include "planner/plan/refusal.h"

namespace corbot::rate {
namespace {

using numeric::PathFunction;

/// Tolerances of a cell.
struct Tolerance {
  double off;    ///< m and rad, of the tool
  double third;  ///< of the third derivative, as a part of the jerk limit
  double part;   ///< alternative to `third`: a part of the third derivative itself
};
// Each entry is for paths on which the previous one takes too many knots. If a third derivative exceeds the
// joint's limit, the rate falls.
constexpr Tolerance kWanted[] = {{1e-8, 0.03, 0.0}, {1e-7, 0.6, 0.01}, {1e-7, 0.6, 0.05}, {1e-7, 6.0, 0.3}};
constexpr double kLongestCell_q = 0.35;
constexpr double kShortest = 1e-9;    // of s: halving has led to a singularity or to the border of the reach
constexpr double kBeside = 5e-7;      // m and rad: a path that misses a singularity by less leads through it
constexpr double kPoint = 1.0 / 512;  // largest error of a cell across a singularity, part of the path
// largest error of a cell across a singularity, as a part of the path's length
constexpr double kPartOff = 3e-4;
constexpr int kMostPasses = 4;       // most singularities that a path may lead through
constexpr double kSingular = 1e7;    // for larger entries of M⁻¹ derivatives carry too much rounding error
constexpr double kAlong = 1e-7;      // largest part of a path's rate that a held joint may leave over
constexpr double kRounding = 2e-15;  // of the tool, m and rad: some units in the last place

class Geometry {
 public:
  /// All arguments must outlive this.
  Geometry(const ArmModel& model, const PathFunction& path, std::uint32_t solution, const Joints& start_q,
           const State& speed)
      : model_(model), arm_(model.kinematics), path_(path), first_(solution), start_q_(start_q) {
    for (std::size_t i = 0; i < arm_.joint_count(); ++i) weight_[i] = 1.0 / speed[i];
    weight_[kPath] = 1.0 / speed[kPath];
  }

  KnotList plan(const Tolerance& tolerance) {
    tolerance_ = tolerance;
    solution_ = first_;
    passes_ = 0;
    impassable_ = -1.0;
    knots_.clear();
    if (const std::optional<Knot> first = knot(0.0, start_q_)) {
      knots_.push_back(*first);
    } else if (const std::optional<End> end = singular_end(0.0, start_q_)) {
      knots_ = {end->knot, end->next};
      knots_.back().lambda_s = end->length_s;
    } else {
      return refused(0.0,
                     "from where this arm follows no line and no arc: the arm is at a singularity, so move "
                     "its joints first");
    }
    std::optional<End> last;
    if (const std::optional<Joints> q = arm_.has_closed_form() ? joints(1.0, start_q_) : std::nullopt;
        q && !knot(1.0, *q)) {
      last = singular_end(1.0, *q);
      if (!last) return refused(1.0, "where the arm is at a singularity that it cannot reach smoothly");
    }
    if (!fill(last ? last->next.z[kPath] : 1.0) || (last && are_too_many())) {
      return refused(knots_.back().z[kPath],
                     are_too_many()
                         ? fmt::format("up to where it needs {} knots: make it shorter", kMostKnots)
                         : "beyond which the path leaves the arm's reach, or leads through a singularity");
    }
    if (last && !arm_.same(joints_of(last->next.z), joints_of(knots_.back().z), Kinematics::kSameJoints_q))
      return refused(1.0, "where the arm is at a singularity that it cannot reach smoothly");
    if (last) append(last->knot, last->length_s);
    return knots_;
  }
  [[nodiscard]] bool are_too_many() const noexcept { return knots_.size() >= kMostKnots; }

 private:
  /// A singular end of the path, the nearest regular knot, and the length of the cell between them.
  struct End {
    Knot knot, next;
    double length_s;
  };

  [[nodiscard]] double dot(const State& a, const State& b) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += weight_[i] * weight_[i] * a[i] * b[i];
    return sum;
  }

  /// Returns the joints at s. An arm without a closed form takes the solution next to `hint`.
  [[nodiscard]] std::optional<Joints> joints(double s, const Joints& hint) const noexcept {
    const PathPoint point = path_.point(s);
    if (arm_.has_closed_form()) {
      const IkSolution ik = joints_at(model_, point, solution_, start_q_);
      if (ik.status != IkStatus::kOk) return std::nullopt;
      return ik.joints_q;
    }
    Joints q = hint;
    if (!numeric::refine(arm_, point, q)) return std::nullopt;
    return q;
  }

  /// Returns M(q)·rate without the rows of followed angles, which do not change with q.
  [[nodiscard]] TaskRate moved(const Joints& q, const Joints& rate) const noexcept {
    const Jacobian jacobian = arm_.jacobian(q);
    TaskRate moved{};
    const std::size_t rows = arm_.follows() == Follows::kFull ? 6 : 3;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t i = 0; i < arm_.joint_count(); ++i) moved[k] += jacobian[k][i] * rate[i];
    }
    return moved;
  }

  /// Returns the joint that can have any value at this point. The closed form leaves such a joint at its
  /// value at the path's beginning.
  [[nodiscard]] std::size_t free_joint(double s, const Joints& q) const noexcept {
    constexpr double kNudge_q = 1e-3;
    for (std::size_t i = 0; arm_.has_closed_form() && i < arm_.joint_count(); ++i) {
      Joints from = start_q_;
      from[i] += kNudge_q;
      const IkSolution ik = joints_at(model_, path_.point(s), solution_, from);
      if (ik.status == IkStatus::kOk && std::abs(ik.joints_q[i] - q[i] - kNudge_q) < 1e-9) return i;
    }
    return PathForm::kNoJoint;
  }

  /// Returns the form at s, or nothing at a singularity. If a joint is free there, the form holds that joint.
  [[nodiscard]] std::optional<PathForm> form_at(double s, const Joints& q) const noexcept {
    const auto is_far = [](const PathForm& form) {
      return form.is_regular() && form.greatest_inverse() < kSingular;
    };
    const PathForm form(arm_, q);
    if (is_far(form)) return form;
    const PathForm holding(arm_, q, free_joint(s, q));
    return is_far(holding) ? std::optional(holding) : std::nullopt;
  }

  /// Returns the knot at s, or nothing at a singularity across the path. With sigma = d lambda/ds and T =
  /// q_s/sigma: z′ = (T, 1/sigma) and z″ = (c, 0) − kappa z′. M c = p_ss/sigma² − M′[T] T. kappa = c·T in the
  /// metric. M′ is a difference of M along T.
  [[nodiscard]] std::optional<Knot> knot(double s, const Joints& q) const noexcept {
    constexpr double kStep_q = 1e-4;
    const std::optional<PathForm> form = form_at(s, q);
    if (!form) return std::nullopt;
    const std::size_t held = form->held();
    TaskRate rate{};
    const Vector3 velocity = path_.velocity_m(s), bend = path_.bend_m(s);
    for (std::size_t k = 0; k < 3; ++k) {
      rate[k] = velocity[k];
      rate[3 + k] = path_.turn_rad()[k];
    }
    State z{}, along{}, c{};
    std::copy(q.begin(), q.end(), z.begin());
    z[kPath] = s;
    Joints q_s = form->solve(rate);
    if (held != PathForm::kNoJoint && !(std::abs(std::exchange(q_s[held], 0.0)) < kAlong * size(s)))
      return std::nullopt;
    std::copy(q_s.begin(), q_s.end(), along.begin());
    along[kPath] = 1.0;
    const double sigma = std::sqrt(dot(along, along));
    if (!std::isfinite(sigma)) return std::nullopt;
    Joints direction{};
    double fastest = 0.0;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      direction[i] = q_s[i] / sigma;
      fastest = std::max(fastest, std::abs(direction[i]));
    }
    const double step = kStep_q / std::max(fastest, 1e-12);
    Joints before = q, after = q;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      before[i] -= step * direction[i];
      after[i] += step * direction[i];
    }
    const TaskRate a = moved(before, direction), b = moved(after, direction);
    TaskRate left{};
    for (std::size_t k = 0; k < left.size(); ++k)
      left[k] = (k < 3 ? bend[k] / (sigma * sigma) : 0.0) - (b[k] - a[k]) / (2.0 * step);
    Joints curved = form->solve(left);
    if (held != PathForm::kNoJoint) curved[held] = 0.0;
    std::copy(curved.begin(), curved.end(), c.begin());
    for (double& x : along) x /= sigma;
    const double kappa = dot(c, along);
    Knot knot{0.0, z, along, c};
    for (std::size_t i = 0; i < z.size(); ++i) knot.bend[i] -= kappa * along[i];
    return knot;
  }

  /// Returns the length h of the curve between two knots, `a` first. With D = z′a + z′b, h solves D·(zb − za)
  /// = h/2 D·D + h²/12 D·(z″a − z″b), the two-point Taylor formula. Its error is of the order h⁵.
  [[nodiscard]] double length_s(const Knot& a, const Knot& b) const noexcept {
    State sum{}, bends{}, chord{};
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] = a.rate[i] + b.rate[i];
      bends[i] = a.bend[i] - b.bend[i];
      chord[i] = b.z[i] - a.z[i];
    }
    const double straight = std::sqrt(dot(chord, chord));
    const double linear = 0.5 * dot(sum, sum), square = dot(sum, bends) / 12.0, wanted = dot(sum, chord);
    double h = straight;
    for (int step = 0; step < 3; ++step)
      h -= (h * (linear + h * square) - wanted) / (linear + 2.0 * h * square);
    return h > 0.9 * straight && h < 1.6 * straight ? h : straight;
  }

  [[nodiscard]] double off(const State& z) const noexcept {
    return tool_deviation(arm_, joints_of(z), path_.point(z[kPath]));
  }
  [[nodiscard]] static Joints joints_of(const State& z) noexcept {
    Joints q{};
    std::copy_n(z.begin(), q.size(), q.begin());
    return q;
  }

  /// Checks a cell by the tool at three points and by the joints in the middle. An error e of a third
  /// derivative is e·h³/384 in the middle. The tool alone hardly shows the error of a joint whose axis is
  /// close to it.
  [[nodiscard]] bool accepts(const Knot& a, const Knot& b, double length_s, double third) const noexcept {
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      if (!(std::abs(b.z[i] - a.z[i]) <= kLongestCell_q)) return false;
    }
    const Cell cell(a, b, length_s);
    for (const double t : {0.5, 0.25, 0.75}) {
      if (!(off(cell.at(t)) <= tolerance_.off)) return false;
    }
    const State middle = cell.at(0.5);
    const std::optional<Joints> q = joints(middle[kPath], joints_of(middle));
    if (!q) return false;
    const State bend_rate = cell.at(0.5, 3);
    double excess = 0.0;
    for (std::size_t i = 0; i < arm_.joint_count(); ++i) {
      const double jerk =
          std::max(third * model_.joints[i].jerk_q_s3, tolerance_.part * std::abs(bend_rate[i]));
      excess = std::max(excess, 384.0 * std::abs((*q)[i] - middle[i]) - jerk * std::pow(length_s, 3));
    }
    if (excess <= 0.0) return true;
    const std::optional<PathForm> form = form_at(middle[kPath], *q);
    // Next to a singularity the joints themselves have this rounding error.
    const double inverse = (form ? *form : PathForm(arm_, *q)).greatest_inverse();
    return excess <= 384.0 * kRounding * inverse;
  }

  void append(Knot next, double length_s) {
    next.lambda_s = knots_.back().lambda_s + length_s;
    knots_.push_back(next);
  }

  /// Adds knots after the last one, up to s = `end`, and halves each cell until it is accepted. Returns false
  /// if kShortest or kMostKnots is reached.
  [[nodiscard]] bool fill(double end) {
    std::vector<double> open{end};
    for (const double s : {0.75, 0.5, 0.25}) {
      if (s < end && s > knots_.back().z[kPath]) open.push_back(s);
    }
    while (!open.empty()) {
      const Knot& last = knots_.back();
      const double s = open.back(), ds = s - last.z[kPath];
      const double h = ds / last.rate[kPath];  // first estimate of the increase of lambda
      Joints hint{};
      for (std::size_t i = 0; i < kMaxJoints; ++i)
        hint[i] = last.z[i] + h * (last.rate[i] + 0.5 * h * last.bend[i]);
      const std::optional<Joints> q = joints(s, hint);
      const std::optional<Knot> next = q ? knot(s, *q) : std::nullopt;
      const double length = next ? length_s(last, *next) : 0.0;
      if (next && accepts(last, *next, length, tolerance_.third)) {
        if (are_too_many()) return false;
        append(*next, length);
        open.pop_back();
      } else if (is_point(s, ds) && !is_point(s, std::abs(s - impassable_)) && pass(s, end)) {
        while (!open.empty() && open.back() <= knots_.back().z[kPath]) open.pop_back();
      } else if (ds < kShortest) {
        return false;
      } else {
        open.push_back(last.z[kPath] + 0.5 * ds);
      }
    }
    return true;
  }

  [[nodiscard]] double size(double s) const noexcept {
    return std::max(norm(path_.velocity_m(s)), norm(path_.turn_rad()));
  }
  /// Returns true if the tool moves less over ds than the tolerance beside a singularity.
  [[nodiscard]] bool is_point(double s, double ds) const noexcept {
    return ds < kShortest || (ds < kPoint && ds * size(s) < kBeside);
  }

  /// Leads the curve past a place where solutions meet and where it may continue smoothly on another one. One
  /// cell crosses the place at s, from a knot before it to a knot after it. The function takes the longest
  /// cell that does so and drops the knots in between.
  [[nodiscard]] bool pass(double s, double end) {
    if (!arm_.has_closed_form() || passes_ >= kMostPasses) return false;
    for (const double most_off : {tolerance_.off, kBeside}) {
      for (std::size_t from = 0; from < knots_.size(); ++from) {
        for (const double factor : {2.0, 1.5}) {
          const double ds = factor * (s - knots_[from].z[kPath]);
          if (knots_[from].z[kPath] + ds > end) continue;
          const std::optional<End> over = crossing(knots_[from], ds, most_off);
          if (!over) continue;
          knots_.resize(from + 1);
          append(over->next, over->length_s);
          ++passes_;
          return true;
        }
      }
    }
    impassable_ = s;
    return false;
  }

  /// Returns a cell from a knot to s + ds, on the solution that continues the curve; this solution becomes
  /// the present one.
  [[nodiscard]] std::optional<End> crossing(const Knot& before, double ds, double most_off) {
    const double h = ds / before.rate[kPath], s = before.z[kPath] + ds;
    double moved = 0.0;
    for (std::size_t i = 0; i < kMaxJoints; ++i) moved = std::max(moved, std::abs(h * before.rate[i]));
    if (!(moved <= kLongestCell_q)) return std::nullopt;
    for (std::uint32_t number = 0; arm_.has_solution(number); ++number) {
      const IkSolution ik = joints_at(model_, path_.point(s), number, start_q_);
      double miss = 0.0;
      for (std::size_t i = 0; i < arm_.joint_count(); ++i)
        miss = std::max(miss, std::abs(ik.joints_q[i] - (before.z[i] + h * before.rate[i])));
      if (ik.status != IkStatus::kOk || miss > 0.3 * moved + 1e-6) continue;
      const std::optional<Knot> next = knot(s, ik.joints_q);
      if (!next) continue;
      const double length = length_s(before, *next);
      if (!crosses({before, *next, length}, most_off)) continue;
      solution_ = number;
      return End{before, *next, length};
    }
    return std::nullopt;
  }

  /// Checks a cell across a singularity. It has no joints to compare with, so the tool's third derivative is
  /// checked. Its error may be kWanted[0].third of the jerk limit.
  [[nodiscard]] bool crosses(const End& over, double most_off) const noexcept {
    const double jerk = std::min(model_.path.jerk_m_s3, model_.path.rotation_jerk_rad_s3);
    const double by_jerk = kWanted[0].third * jerk * std::pow(over.length_s, 3) / 384.0;
    const double most =
        std::min({most_off, std::max(tolerance_.off, by_jerk), kPartOff * size(over.knot.z[kPath])});
    const Cell cell(over.knot, over.next, over.length_s);
    for (int k = 1; k < 8; ++k) {
      if (!(off(cell.at(k / 8.0)) <= most)) return false;
    }
    return true;
  }

  /// Returns the cell at s = 0 or 1, where the joints are `q` and have no derivatives. The derivatives are
  /// those of a polynomial through the end and two knots beside it.
  [[nodiscard]] std::optional<End> singular_end(double s, const Joints& q) const noexcept {
    constexpr double kAway_q = 0.12;
    if (!arm_.has_closed_form()) return std::nullopt;
    const double inward = s > 0.5 ? -1.0 : 1.0;
    double ds = 0.2;
    while (true) {
      const std::optional<Joints> there = joints(s + inward * ds, q);
      if (!there) return std::nullopt;
      double away = 0.0;
      for (std::size_t i = 0; i < kMaxJoints; ++i) away = std::max(away, std::abs((*there)[i] - q[i]));
      if (away <= 1.25 * kAway_q) break;
      ds *= std::clamp(kAway_q * kAway_q / (away * away), 0.02, 0.7);  // q varies as the root of s
      if (ds < kShortest) return std::nullopt;                         // the joints jump
    }
    for (int step = 0; step < 17; ++step, ds *= 0.3) {
      std::array<Knot, 5> beside;
      // Measured from the first knot to the last, in parts: the fit amplifies an error of the length.
      double length = 0.0;
      std::size_t found = 0;
      for (; found < beside.size(); ++found) {
        const double at = s + inward * ds * std::exp2(0.5 * static_cast<double>(found));
        const std::optional<Joints> there = joints(at, q);
        const std::optional<Knot> next = there ? knot(at, *there) : std::nullopt;
        if (!next) break;
        beside[found] = *next;
        if (found > 0)
          length += inward > 0.0 ? length_s(beside[found - 1], *next) : length_s(*next, beside[found - 1]);
      }
      if (found < beside.size()) continue;
      State z{};
      std::copy(q.begin(), q.end(), z.begin());
      z[kPath] = s;
      const End end = fitted(z, beside.front(), beside.back(), length, inward);
      // The coarser third derivative suffices, since this cell is passed near rest.
      const Knot &first = inward > 0.0 ? end.knot : end.next, &last = inward > 0.0 ? end.next : end.knot;
      if (accepts(first, last, end.length_s, kWanted[1].third)) return end;
    }
    return std::nullopt;
  }

  /// Fits the end's derivatives. Let x be the part of the cell from a to b, counted from a away from the end.
  /// P(x) = Q(x) + k x³(x − 1)³ goes through both knots like Q, and through z at x = −h/ab. A secant finds
  /// the length h for which the end's rate has length 1. `ab`: length of the curve between the knots.
  /// `inward`: 1 at the path's first point, −1 at its last.
  [[nodiscard]] End fitted(const State& z, Knot a, Knot b, double ab, double inward) const noexcept {
    End end{{0.0, z, {}, {}}, a, 0.0};
    for (std::size_t i = 0; i < z.size(); ++i) {
      a.rate[i] *= inward;
      b.rate[i] *= inward;
    }
    const Cell cell(a, b, ab);
    const auto excess = [&](double h) {
      const double x = -h / ab, y = x * (x - 1.0);
      const State at = cell.at(x), rate = cell.at(x, 1), bend = cell.at(x, 2);
      for (std::size_t i = 0; i < z.size(); ++i) {
        const double k = (z[i] - at[i]) / (y * y * y);
        end.knot.rate[i] = inward * (rate[i] + k * 3.0 * y * y * (2.0 * x - 1.0) / ab);
        end.knot.bend[i] = bend[i] + k * 6.0 * y * (5.0 * y + 1.0) / (ab * ab);
      }
      return std::sqrt(dot(end.knot.rate, end.knot.rate)) - 1.0;
    };
    State chord{};
    for (std::size_t i = 0; i < z.size(); ++i) chord[i] = a.z[i] - z[i];
    double h0 = std::sqrt(dot(chord, chord)), h = 1.001 * h0;
    double e0 = excess(h0), e = excess(h);
    for (int step = 0; step < 8 && std::abs(e) > 1e-12 && e != e0; ++step) {
      const double next = std::clamp(h - e * (h - h0) / (e - e0), 0.8 * h, 1.3 * h);
      h0 = h;
      e0 = e;
      h = next;
      e = excess(h);
    }
    end.length_s = h;
    return end;
  }

  [[nodiscard]] PlanRefusal refused(double s, const std::string& why) const {
    PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "P", Quantity::kNumber);
    refusal.target_m = path_.point(s).position_m;
    refusal.text = fmt::format("the path can be followed to ({:.6g}, {:.6g}, {:.6g}) m, {:.3g} % of it, {}",
                               refusal.target_m[0], refusal.target_m[1], refusal.target_m[2], 100.0 * s, why);
    return refusal;
  }

  const ArmModel& model_;
  const Kinematics& arm_;
  const PathFunction& path_;
  std::uint32_t first_, solution_{};  ///< numbers of the solution at the path's beginning and now
  int passes_{};
  double impassable_{-1.0};  ///< s at which no cell continued the curve
  const Joints& start_q_;
  State weight_{};  ///< 1/v, 0 beyond the arm's joints
  Tolerance tolerance_{};
  std::vector<Knot> knots_;
};

template <class Motion>
KnotList plan(const ArmModel& model, const Motion& motion, const Joints& start_q, const State& speed) {
  const PathFunction path(motion);
  if (model.dof < 3) return follows_no_path(model.dof, path.point(1.0).position_m);
  Geometry geometry(model, path, motion.solution, start_q, speed);
  KnotList knots;
  for (const Tolerance& tolerance : kWanted) {
    knots = geometry.plan(tolerance);
    if (std::holds_alternative<std::vector<Knot>>(knots) || !geometry.are_too_many()) break;
  }
  return knots;
}

}  // namespace

KnotList plan_geometry(const ArmModel& model, const LineMotion& line, const Joints& start_q,
                       const State& speed) {
  return plan(model, line, start_q, speed);
}
KnotList plan_geometry(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
                       const State& speed) {
  return plan(model, arc, start_q, speed);
}

}  // namespace corbot::rate
