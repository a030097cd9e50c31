// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"

// Proves that a rate along a path keeps all limits at every instant, not at samples alone. The planner uses
// it, and the task again, which trusts no byte that it did not write. Real-time safe.

namespace corbot::rate {

/// Parts of the limits of acceleration and jerk that a plan leaves free, so that a motion can slow down to
/// rest at any instant.
inline constexpr double kAccelerationReserve = 0.03;
inline constexpr double kJerkReserve = 0.05;

/// Limits of speed, acceleration and jerk of each joint (rad or m, and s), and of s by the tool's turning. On
/// a line they also limit s by the tool's travel. A limit is infinite if nothing is limited, as beyond the
/// arm's joints.
struct Limits {
  State speed{}, acceleration{}, jerk{};
  /// On an arc the tool's limits apply to vectors, in units of its length: along s″ and across angle · s′²,
  /// and so on.
  double angle_rad{};  ///< angle of the arc; 0 on a line
  double arc_acceleration{}, arc_jerk{};
};
/// Returns the arm's limits for a path.
[[nodiscard]] Limits limits_of(const ArmModel& model, const LineMotion& line) noexcept;
[[nodiscard]] Limits limits_of(const ArmModel& model, const ArcMotion& arc) noexcept;

/// The finite limits.
class RateLimits {
 public:
  RateLimits() = default;
  explicit RateLimits(const Limits& limits) noexcept {
    for (std::size_t i = 0; i <= kPath; ++i) {
      if (std::isfinite(limits.acceleration[i]) && std::isfinite(limits.jerk[i]))
        all_[count_++] = {limits.speed[i], limits.acceleration[i], limits.jerk[i]};
    }
    if (limits.angle_rad > 0.0)
      all_[count_++] = {limits.speed[kPath], limits.arc_acceleration, limits.arc_jerk};
  }
  [[nodiscard]] auto begin() const noexcept { return all_.begin(); }
  [[nodiscard]] auto end() const noexcept { return all_.begin() + static_cast<std::ptrdiff_t>(count_); }
  [[nodiscard]] std::span<const RateLimit> view() const noexcept { return {all_.data(), count_}; }

 private:
  std::array<RateLimit, RateCurve::kMostLimits> all_{};
  std::size_t count_{0};
};

/// Bounds a law's shares at every instant. Consider a stretch of time d within one piece and one cell, and
/// any f, scalar or vector. Then |f| <= max of both ends + d²/8 · max |f″|, the error of linear
/// interpolation. The chain rule bounds the derivatives of z(lambda(t)) by time from those of z by lambda and
/// of lambda by time. The same formula bounds these.
class ProofWalk {
 public:
  /// kRefused: the piece goes back, or one of its numbers is not finite.
  enum class Result { kMore, kDone, kRefused };

  ProofWalk() = default;
  /// `knots`: knots of the law's path. `shares`: one for each piece, to be filled. All arguments outlive this
  /// object.
  ProofWalk(const RatePieces& law, std::span<const Knot> knots, const Limits& limits,
            std::span<Shares> shares) noexcept
      : law_(law), knots_(knots), limits_(&limits), shares_(shares) {
    for (const Piece& piece : law.pieces) least_v_ = std::min(least_v_, -kBackward * piece.begin.v);
  }
  /// Does one stretch. There are fewer stretches than pieces and knots together.
  [[nodiscard]] Result step() noexcept;

 private:
  static constexpr double kBackward = 1e-9;  ///< part of the greatest rate: rounding at the ends

  [[nodiscard]] double end_s() const noexcept {
    return piece_ + 1 < law_.pieces.size() ? law_.pieces[piece_ + 1].begin_s : law_.duration_s;
  }

  RatePieces law_{};
  std::span<const Knot> knots_;
  const Limits* limits_{};
  std::span<Shares> shares_;
  double least_v_{0.0};
  double now_s_{0.0};
  std::size_t piece_{0}, cell_{0};
  bool is_inside_{false};  ///< inside the piece
};

namespace detail {

[[nodiscard]] inline double greatest(const std::array<double, 2>& x) noexcept {
  return std::max(std::abs(x[0]), std::abs(x[1]));
}

/// Derivatives of one z by time: at both ends of a stretch, and bounds of their magnitudes in between.
struct Derivatives {
  std::array<double, 2> rate{}, bend{}, third{};
  double rate_bound{}, bend_bound{}, third_bound{};
  double fourth_bound{}, fifth_bound{};
};

/// A stretch of time within one piece and one cell.
class Stretch {
 public:
  Stretch(const RateState& begin, const RateState& end, double duration_s, const Cell& cell,
          double cell_begin_s)
      : ends_{begin, end}, eighth_(duration_s * duration_s / 8.0) {
    const double length = end.lambda_s - begin.lambda_s;
    lambda_eighth_ = length * length / 8.0;
    v_ = greatest({begin.v, end.v}) + eighth_ * std::abs(begin.j);
    a_ = greatest({begin.a, end.a});
    j_ = std::abs(begin.j);
    for (std::size_t e = 0; e < 2; ++e) {
      const double t = std::clamp((ends_[e].lambda_s - cell_begin_s) / cell.length_s(), 0.0, 1.0);
      for (std::size_t order = 1; order <= 5; ++order) z_[order][e] = cell.at(t, order);
    }
  }

  [[nodiscard]] Derivatives of(std::size_t i) const noexcept {
    const auto ends = [&](std::size_t order) { return greatest({z_[order][0][i], z_[order][1][i]}); };
    const double b5 = ends(5), b4 = ends(4);  // the fourth is linear
    const double b3 = ends(3) + lambda_eighth_ * b5, b2 = ends(2) + lambda_eighth_ * b4;
    const double b1 = ends(1) + lambda_eighth_ * b3;
    const double v = v_, a = a_, j = j_;
    Derivatives d;
    for (std::size_t e = 0; e < 2; ++e) {
      const RateState& at = ends_[e];
      const double z1 = z_[1][e][i], z2 = z_[2][e][i], z3 = z_[3][e][i];
      d.rate[e] = z1 * at.v;
      d.bend[e] = z2 * at.v * at.v + z1 * at.a;
      d.third[e] = z3 * at.v * at.v * at.v + 3.0 * z2 * at.v * at.a + z1 * at.j;
    }
    const double third = b3 * v * v * v + 3.0 * b2 * v * a + b1 * j;
    d.fourth_bound = b4 * v * v * v * v + 6.0 * b3 * v * v * a + b2 * (3.0 * a * a + 4.0 * v * j);
    d.fifth_bound = b5 * v * v * v * v * v + 10.0 * b4 * v * v * v * a +
                    b3 * (15.0 * v * a * a + 10.0 * v * v * j) + 10.0 * b2 * a * j;
    d.rate_bound = between(greatest(d.rate), third);
    d.bend_bound = between(greatest(d.bend), d.fourth_bound);
    d.third_bound = between(greatest(d.third), d.fifth_bound);
    return d;
  }
  /// Returns a bound from the greatest value at both ends, and a bound of the second derivative.
  [[nodiscard]] double between(double ends, double bend) const noexcept { return ends + eighth_ * bend; }

 private:
  std::array<RateState, 2> ends_;
  double eighth_, lambda_eighth_;
  double v_, a_, j_;                         ///< bounds of lambda's derivatives by time
  std::array<std::array<State, 2>, 6> z_{};  ///< derivatives by lambda: order, end
};

/// Takes the tool's acceleration and jerk on an arc, by its length: (s″, w s′²) and (s‴ − w² s′³, 3 w s′ s″),
/// w the arc's angle.
inline void take_arc(const Stretch& stretch, const Derivatives& s, const Limits& limits,
                     Shares& shares) noexcept {
  const double w = limits.angle_rad;
  std::array<double, 2> acceleration{}, jerk{};
  for (std::size_t e = 0; e < 2; ++e) {
    const double p1 = s.rate[e], p2 = s.bend[e];
    acceleration[e] = std::hypot(p2, w * p1 * p1);
    jerk[e] = std::hypot(s.third[e] - w * w * p1 * p1 * p1, 3.0 * w * p1 * p2);
  }
  const double p1 = s.rate_bound, p2 = s.bend_bound, p3 = s.third_bound, w2 = w * w;
  const double fourth = s.fourth_bound + w * (4.0 * p1 * p3 + 3.0 * p2 * p2) + 6.0 * w2 * p1 * p1 * p2 +
                        w2 * w * p1 * p1 * p1 * p1;
  const double fifth = s.fifth_bound + w * (5.0 * p1 * s.fourth_bound + 10.0 * p2 * p3) +
                       w2 * (10.0 * p1 * p1 * p3 + 15.0 * p1 * p2 * p2) + 10.0 * w2 * w * p1 * p1 * p1 * p2 +
                       w2 * w2 * p1 * p1 * p1 * p1 * p1;
  shares.acceleration = std::max(shares.acceleration,
                                 stretch.between(greatest(acceleration), fourth) / limits.arc_acceleration);
  shares.jerk = std::max(shares.jerk, stretch.between(greatest(jerk), fifth) / limits.arc_jerk);
}

/// Takes a stretch into the shares. False if a bound is not finite.
[[nodiscard]] inline bool take(const Stretch& stretch, const Limits& limits, Shares& shares) noexcept {
  for (std::size_t i = 0; i <= kPath; ++i) {
    if (!std::isfinite(limits.speed[i]) && i != kPath) continue;
    const Derivatives d = stretch.of(i);
    if (!std::isfinite(d.rate_bound + d.fourth_bound + d.fifth_bound)) return false;
    shares.speed = std::max(shares.speed, d.rate_bound / limits.speed[i]);
    shares.acceleration = std::max(shares.acceleration, d.bend_bound / limits.acceleration[i]);
    shares.jerk = std::max(shares.jerk, d.third_bound / limits.jerk[i]);
    if (i == kPath && limits.angle_rad > 0.0) take_arc(stretch, d, limits, shares);
  }
  return true;
}

/// Returns the time between two times at which lambda has the value, by halving.
[[nodiscard]] inline double time_at(const RatePieces& law, std::size_t piece, double low_s, double high_s,
                                    double lambda_s) noexcept {
  for (int step = 0; step < 60; ++step) {
    const double middle_s = 0.5 * (low_s + high_s);
    (law.at(piece, middle_s).lambda_s < lambda_s ? low_s : high_s) = middle_s;
  }
  return high_s;
}

/// Checks the speed: at constant jerk it is least at an end, or where the acceleration passes 0.
[[nodiscard]] inline bool is_forward(const RateState& begin, const RateState& end, double least) noexcept {
  if (!(begin.v >= least && end.v >= least)) return false;
  return !(begin.a < 0.0 && end.a > 0.0) || begin.v - begin.a * begin.a / (2.0 * begin.j) >= least;
}

[[nodiscard]] inline Limits common_limits(const ArmModel& model, double length_m,
                                          double rotation_rad) noexcept {
  constexpr double kNone = 1e-30, kInfinity = std::numeric_limits<double>::infinity();
  const auto per = [](double limit, double amount) { return amount > kNone ? limit / amount : kInfinity; };
  const PathLimits& path = model.path;
  Limits limits;
  limits.speed.fill(kInfinity);
  limits.acceleration.fill(kInfinity);
  limits.jerk.fill(kInfinity);
  for (std::size_t i = 0; i < std::min<std::size_t>(model.dof, kMaxJoints); ++i) {
    limits.speed[i] = model.joints[i].speed_q_s;
    limits.acceleration[i] = model.joints[i].acceleration_q_s2;
    limits.jerk[i] = model.joints[i].jerk_q_s3;
  }
  limits.speed[kPath] = std::min(per(path.speed_m_s, length_m), per(path.rotation_speed_rad_s, rotation_rad));
  limits.acceleration[kPath] = per(path.rotation_acceleration_rad_s2, rotation_rad);
  limits.jerk[kPath] = per(path.rotation_jerk_rad_s3, rotation_rad);
  limits.arc_acceleration = per(path.acceleration_m_s2, length_m);
  limits.arc_jerk = per(path.jerk_m_s3, length_m);
  return limits;
}

}  // namespace detail

inline Limits limits_of(const ArmModel& model, const LineMotion& line) noexcept {
  Limits limits = detail::common_limits(model, length_m(line), rotation_rad(line.tool));
  limits.acceleration[kPath] = std::min(limits.acceleration[kPath], limits.arc_acceleration);
  limits.jerk[kPath] = std::min(limits.jerk[kPath], limits.arc_jerk);
  return limits;
}

inline Limits limits_of(const ArmModel& model, const ArcMotion& arc) noexcept {
  Limits limits = detail::common_limits(model, length_m(arc), rotation_rad(arc.tool));
  limits.angle_rad = arc.angle_rad;
  return limits;
}

inline ProofWalk::Result ProofWalk::step() noexcept {
  const double end_s = this->end_s();
  const RateState end = law_.at(piece_, end_s);
  if (!is_inside_) {
    now_s_ = law_.pieces[piece_].begin_s;
    shares_[piece_] = {};
    is_inside_ = true;
    if (!detail::is_forward(law_.at(piece_, now_s_), end, least_v_)) return Result::kRefused;
  }
  // Goes as far as this piece lies in this cell.
  const Knot &a = knots_[cell_], &b = knots_[cell_ + 1];
  const bool leaves = cell_ + 2 < knots_.size() && end.lambda_s > b.lambda_s;
  const double to_s = leaves ? detail::time_at(law_, piece_, now_s_, end_s, b.lambda_s) : end_s;
  const detail::Stretch stretch(law_.at(piece_, now_s_), law_.at(piece_, to_s), to_s - now_s_, Cell(a, b),
                                a.lambda_s);
  if (now_s_ < end_s && !detail::take(stretch, *limits_, shares_[piece_])) return Result::kRefused;
  now_s_ = to_s;
  if (leaves) ++cell_;
  if (now_s_ < end_s) return Result::kMore;
  is_inside_ = false;
  return ++piece_ < law_.pieces.size() ? Result::kMore : Result::kDone;
}

}  // namespace corbot::rate
