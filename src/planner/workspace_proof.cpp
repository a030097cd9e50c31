// SPDX-License-Identifier: Apache-2.0
#include "planner/workspace_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "corbot/interface_words.h"
#include "corbot/kinematics/arm_parts.h"
#include "corbot/motion/bounds.h"
#include "corbot/motion/law_evaluation.h"

namespace corbot {
namespace {

/// A proof needs some hundred stretches along a floor. One that needs more is refused.
constexpr std::size_t kMostStretches = 100'000;
constexpr std::size_t kShownSteps = 256;  ///< in which a refusal looks for the deepest point

/// The joints on a stretch, and bounds of their derivatives that hold everywhere on it.
struct Stretch {
  double half{};
  Joints middle_q{}, rate{};  ///< in the middle
  Joints rate_bound{}, bend_bound{};
};

/// A joint motion, by its time.
class LawCurve {
 public:
  LawCurve(std::size_t dof, const Joints& start_q, const JointMotion& motion, double duration_s)
      : dof_(dof), start_q_(start_q), motion_(motion), duration_s_(duration_s) {
    for (std::size_t i = 0; i < dof; ++i) peaks_[i] = peaks(motion.law[i]);
  }
  [[nodiscard]] std::size_t pieces() const noexcept { return 1; }
  void enter(std::size_t) noexcept {}
  [[nodiscard]] double length() const noexcept { return duration_s_; }
  [[nodiscard]] Joints joints_at(double t_s) const noexcept {
    Joints q = start_q_;
    for (std::size_t i = 0; i < dof_; ++i) q[i] += evaluate(motion_.law[i], t_s).position;
    return q;
  }
  [[nodiscard]] Stretch around(double t_s, double half_s) const noexcept {
    Stretch found{half_s, start_q_};
    for (std::size_t i = 0; i < dof_; ++i) {
      const LawState now = evaluate(motion_.law[i], t_s);
      const LawPeaks& peak = peaks_[i];
      found.middle_q[i] += now.position;
      found.rate[i] = now.velocity;
      found.bend_bound[i] = std::min(peak.acceleration, std::abs(now.acceleration) + peak.jerk * half_s);
      found.rate_bound[i] = std::min(peak.velocity, std::abs(now.velocity) + found.bend_bound[i] * half_s);
    }
    return found;
  }

 private:
  std::size_t dof_;
  const Joints& start_q_;
  const JointMotion& motion_;
  double duration_s_;
  std::array<LawPeaks, kMaxJoints> peaks_{};
};

/// A line or an arc, by lambda from the last knot on.
class KnotCurve {
 public:
  KnotCurve(std::size_t dof, std::span<const rate::Knot> knots)
      : dof_(dof), knots_(knots), cell_(knots[0], knots[1]) {}
  [[nodiscard]] std::size_t pieces() const noexcept { return knots_.size() - 1; }
  void enter(std::size_t piece) noexcept { cell_ = rate::Cell(knots_[piece], knots_[piece + 1]); }
  [[nodiscard]] double length() const noexcept { return cell_.length_s(); }
  [[nodiscard]] Joints joints_at(double lambda_s) const noexcept {
    Joints q{};
    std::copy_n(cell_.at(lambda_s / cell_.length_s()).begin(), dof_, q.begin());
    return q;
  }
  [[nodiscard]] Stretch around(double lambda_s, double half_s) const noexcept {
    Stretch found{half_s, joints_at(lambda_s)};
    const double t = lambda_s / cell_.length_s();
    const rate::State rate = cell_.at(t, 1);
    std::copy_n(rate.begin(), dof_, found.rate.begin());
    double weight = 1.0;  // of the Taylor series of the second derivative, which ends
    for (std::size_t order = 2; order <= 5; ++order) {
      const rate::State term = cell_.at(t, order);
      for (std::size_t i = 0; i < dof_; ++i) found.bend_bound[i] += weight * std::abs(term[i]);
      weight *= half_s / static_cast<double>(order - 1);
    }
    for (std::size_t i = 0; i < dof_; ++i)
      found.rate_bound[i] = std::abs(rate[i]) + found.bend_bound[i] * half_s;
    return found;
  }

 private:
  std::size_t dof_;
  std::span<const rate::Knot> knots_;
  rate::Cell cell_;
};

constexpr double kEndTolerance_m = 1e-9;

/// A shape and the part that it holds for.
struct Guard {
  std::size_t shape{}, part{};
  double least_m{};  ///< the least clearance: 0, or that of the start if it is less
};

/// Velocity of a point in the middle of a stretch, and half of h² times the bound of its acceleration.
struct PartTravel {
  Vector3 velocity{};
  double bend_m{};
};

using Travels = std::array<PartTravel, kArmPoints>;

/// |d²p/dq_i dq_j| is at most the greatest |dp/dq_j| on the stretch, i <= j, as the joint nearer to the base
/// turns the other's lever. That lever is longer than in the middle by what the joints beyond j add.
PartTravel travel_of(const PartState& point, const Stretch& stretch, std::size_t joints) noexcept {
  PartTravel travel;
  Joints lever{};
  double stray_m = 0.0;
  for (std::size_t j = joints; j-- > 0;) {
    travel.velocity = travel.velocity + stretch.rate[j] * point.per_q[j];
    lever[j] = norm(point.per_q[j]) + stray_m;
    stray_m += lever[j] * stretch.rate_bound[j] * stretch.half;
  }
  double bend = 0.0, inner = 0.0;
  for (std::size_t j = 0; j < joints; ++j) {
    const double rate = stretch.rate_bound[j];
    bend += lever[j] * (rate * (2.0 * inner + rate) + stretch.bend_bound[j]);
    inner += rate;
  }
  travel.bend_m = 0.5 * bend * stretch.half * stretch.half;
  return travel;
}

/// A point of a curve.
struct Place {
  std::size_t piece{};
  double x{};
};

enum class Verdict { kProved, kRefuted, kOpen };

/// The refusal's view of one point of a motion.
struct DeepPoint {
  double clearance_m{}, travelled_m{}, travel_m{}, share{};
  Vector3 tool_m{};
};

class WorkspaceProof {
 public:
  WorkspaceProof(const ArmModel& model, const Joints& start_q)
      : limits_(model.workspace),
        chain_(model.kinematics.chain()),
        points_(points_of(chain_)),
        parts_(parts_of(points_)) {
    const auto states = part_states(chain_, points_, start_q);
    for (std::size_t shape = 0; shape < limits_.count; ++shape) {
      for (std::size_t part = 0; part < kArmParts; ++part) {
        if (!parts_[part].exists || (limits_.shapes[shape].parts & bit_of(part)) == 0) continue;
        const double start_m = clearance_m(limits_, shape, part, parts_[part], states);
        guards_[count_++] = {shape, part, start_m < -0.5 * kWorkspaceTolerance_m ? start_m : 0.0};
      }
    }
  }

  template <class Curve>
  [[nodiscard]] std::optional<PlanRefusal> check(Curve curve) const {
    std::size_t stretches = 0;
    for (std::size_t piece = 0; piece < curve.pieces(); ++piece) {
      curve.enter(piece);
      std::vector<std::array<double, 2>> open{{0.0, curve.length()}};
      while (!open.empty()) {
        const auto [from, to] = open.back();
        open.pop_back();
        const double middle = 0.5 * (from + to);
        const Guard* guard = nullptr;
        const Verdict verdict = judge(curve.around(middle, 0.5 * (to - from)), guard);
        if (verdict == Verdict::kProved) continue;
        if (verdict == Verdict::kRefuted || ++stretches > kMostStretches)
          return refusal(deepest(curve, *guard, {piece, middle}), *guard);
        open.push_back({middle, to});
        open.push_back({from, middle});
      }
    }
    return check_end(curve);
  }

 private:
  /// A part that is outside at the start is no deeper at the end. The tolerance on the way does not add up
  /// over motions.
  template <class Curve>
  [[nodiscard]] std::optional<PlanRefusal> check_end(Curve& curve) const {
    const std::size_t last = curve.pieces() - 1;
    curve.enter(last);
    const auto states = part_states(chain_, points_, curve.joints_at(curve.length()));
    for (std::size_t k = 0; k < count_; ++k) {
      const Guard& guard = guards_[k];
      if (guard.least_m == 0.0 || clearance_of(guard, states) >= guard.least_m - kEndTolerance_m) continue;
      return refusal(deepest(curve, guard, {last, curve.length()}), guard);
    }
    return std::nullopt;
  }

  /// Sets `of` to the guard that is not proved.
  [[nodiscard]] Verdict judge(const Stretch& stretch, const Guard*& of) const noexcept {
    const auto states = part_states(chain_, points_, stretch.middle_q);
    Travels travels;
    for (std::size_t k = 0; k < kArmPoints; ++k)
      travels[k] = travel_of(states[k], stretch, points_[k].joints);
    for (std::size_t k = 0; k < count_; ++k) {
      const Guard& guard = guards_[k];
      const double here_m = clearance_of(guard, states);
      if (here_m < guard.least_m - 0.5 * kWorkspaceTolerance_m) {
        of = &guard;
        return Verdict::kRefuted;
      }
      if (of == nullptr && !is_proved(guard, here_m, states, travels, stretch.half)) of = &guard;
    }
    return of == nullptr ? Verdict::kProved : Verdict::kOpen;
  }

  [[nodiscard]] double clearance_of(const Guard& guard, const ArmStates& states) const noexcept {
    return clearance_m(limits_, guard.shape, guard.part, parts_[guard.part], states);
  }

  /// A link is on the allowed side of a face if both ends are, less its radius. A link that passes an edge of
  /// a box is beyond no face alone. No point of it moves farther than the end that moves farthest.
  [[nodiscard]] bool is_proved(const Guard& guard, double here_m, const ArmStates& states,
                               const Travels& travels, double half) const noexcept {
    const WorkspaceShape& shape = limits_.shapes[guard.shape];
    const PartEnds& part = parts_[guard.part];
    const double least_m = guard.least_m - kWorkspaceTolerance_m;
    const double axis_m = least_m + radius_m(limits_, guard.part);
    const auto keeps = [&](const HalfSpace& face, std::size_t point) {
      const PartTravel& travel = travels[point];
      return clearance_m(face, states[point].position_m) -
                 std::abs(dot(face.normal, travel.velocity)) * half - travel.bend_m >=
             axis_m;
    };
    const bool is_link = part.from != part.to;
    const auto holds = [&](const HalfSpace& face) {
      return keeps(face, part.from) && (!is_link || keeps(face, part.to));
    };
    const auto end = shape.faces.begin() + shape.face_count;
    if (shape.kind != ShapeKind::kOutside) return std::all_of(shape.faces.begin(), end, holds);
    if (std::any_of(shape.faces.begin(), end, holds)) return true;
    const auto way_m = [&](const PartTravel& travel) { return norm(travel.velocity) * half + travel.bend_m; };
    return is_link && here_m - std::max(way_m(travels[part.from]), way_m(travels[part.to])) >= least_m;
  }

  /// Returns the deepest of many points of the motion, `at` among them.
  template <class Curve>
  [[nodiscard]] DeepPoint deepest(Curve& curve, const Guard& guard, Place at) const {
    DeepPoint found{std::numeric_limits<double>::infinity()};
    std::optional<Vector3> last_m;
    const auto look = [&](double x, double share) {
      const auto states = part_states(chain_, points_, curve.joints_at(x));
      const Vector3& tool_m = states[0].position_m;
      if (last_m) found.travel_m += norm(tool_m - *last_m);
      last_m = tool_m;
      const double here_m = clearance_of(guard, states);
      if (here_m >= found.clearance_m) return;
      found = {here_m, found.travel_m, found.travel_m, share, tool_m};
    };
    const auto count = static_cast<double>(curve.pieces());
    const std::size_t steps = std::max<std::size_t>(2, kShownSteps / curve.pieces());
    for (std::size_t piece = 0; piece < curve.pieces(); ++piece) {
      curve.enter(piece);
      for (std::size_t i = 0; i <= steps; ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(steps);
        const double before = part - 1.0 / static_cast<double>(steps);
        const double of_at = at.x / curve.length();
        if (piece == at.piece && of_at > before && of_at < part)
          look(at.x, (static_cast<double>(piece) + of_at) / count);
        look(part * curve.length(), (static_cast<double>(piece) + part) / count);
      }
    }
    if (found.travel_m > 0.0) found.share = found.travelled_m / found.travel_m;
    return found;
  }

  [[nodiscard]] PlanRefusal refusal(const DeepPoint& point, const Guard& guard) const {
    const WorkspaceShape& shape = limits_.shapes[guard.shape];
    const bool is_floor = shape.kind == ShapeKind::kPlane && shape.faces[0].normal[2] == 1.0;
    const char* side = is_floor                            ? "below"
                       : shape.kind == ShapeKind::kPlane   ? "beyond"
                       : shape.kind == ShapeKind::kOutside ? "inside"
                                                           : "outside";
    const std::string at =
        fmt::format("at {:.3g} % of the path ({:.3g} m)", 100.0 * point.share, point.travelled_m);
    std::string text = point.clearance_m < guard.least_m
                           ? fmt::format("the {} would be {:.3g} mm {} '{}' {}", kPartNames[guard.part],
                                         -1e3 * point.clearance_m, side, shape.name.data(), at)
                           : fmt::format("the {} comes too close to '{}' for a proof, {}",
                                         kPartNames[guard.part], shape.name.data(), at);
    if (guard.least_m < 0.0)
      text += fmt::format("; it stands at {:.3g} mm and may only move back", -1e3 * guard.least_m);
    PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, kWorkspaceWord + text, Quantity::kLength);
    refusal.value = point.clearance_m;
    refusal.lower = guard.least_m;
    refusal.upper = kFarthestCoordinate_m;
    refusal.target_m = point.tool_m;
    refusal.text = std::move(text);
    return refusal;
  }

  const WorkspaceLimits& limits_;
  const JointChain& chain_;
  ArmPoints points_;
  ArmParts parts_;
  std::array<Guard, WorkspaceLimits::kMostShapes * kArmParts> guards_{};
  std::size_t count_{};
};

}  // namespace

std::optional<PlanRefusal> check_workspace(const ArmModel& model, const Joints& start_q,
                                           const JointMotion& motion, double duration_s) {
  if (model.workspace.count == 0) return std::nullopt;
  return WorkspaceProof(model, start_q).check(LawCurve(model.dof, start_q, motion, duration_s));
}

bool leaves_workspace(const PlanRefusal& refusal) { return refusal.parameter.starts_with(kWorkspaceWord); }

std::optional<PlanRefusal> check_workspace(const ArmModel& model, std::span<const rate::Knot> knots) {
  if (model.workspace.count == 0) return std::nullopt;
  Joints start_q{};
  std::copy_n(knots.front().z.begin(), kMaxJoints, start_q.begin());
  return WorkspaceProof(model, start_q).check(KnotCurve(model.dof, knots));
}

}  // namespace corbot
