// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "corbot/kinematics/joints.h"
#include "corbot/motion/rate_pieces.h"

// Stop, pause, override and cancellation along a path. A motion is a function of virtual time, which passes at a rate u of 0 to 1. At
// u = 1 it reaches at most these shares of each of its limits v, a, j: V, A, J. With w = du/dt and z = dw/dt its derivatives by real time
// are at most V v u, A a u² + V v |w| and J j u³ + 3 A a u |w| + V v |z|. So each u(t) keeps all limits, at any place, if everywhere
//   A u² + V v/a |w| <= 1   and   J u³ + 3 A a/j u |w| + V v/j |z| <= 1.
// Real-time safe.

namespace corbot::rate {

/// Of speed, acceleration and jerk limits; 1 is the limit.
struct Shares {
  double speed{}, acceleration{}, jerk{};
};

[[nodiscard]] inline Shares greater(const Shares& x, const Shares& y) noexcept {
  return {std::max(x.speed, y.speed), std::max(x.acceleration, y.acceleration), std::max(x.jerk, y.jerk)};
}

/// Full limits of one quantity that a motion moves; finite and positive.
struct RateLimit {
  double speed{}, acceleration{}, jerk{};
};

/// How fast u may change: |w| <= W(u), by cells of u, in each of which any |z| up to a bound of it will do. W² is linear in a cell. Nowhere
/// does it rise or fall faster than that bound allows, so from any permitted (u, w) a permitted way leads to rest.
class RateCurve {
 public:
  static constexpr std::size_t kCells = 128;
  static constexpr std::size_t kMostLimits = kMaxJoints + 2;

  /// `most`: shares that the motion reaches; those of acceleration and jerk below 1. At most kMostLimits limits.
  RateCurve(std::span<const RateLimit> limits, const Shares& most) noexcept
      : RateCurve(limits, everywhere(most)) {}
  /// `most`: those that it reaches while u is in a cell.
  RateCurve(std::span<const RateLimit> limits, const std::array<Shares, kCells>& most) noexcept;

  /// u where cell k begins; they are narrower towards 1, where little is left of the limits.
  [[nodiscard]] static double node(std::size_t k) noexcept {
    const double rest = 1.0 - static_cast<double>(k) / kCells;
    return 1.0 - rest * rest;
  }
  [[nodiscard]] static std::size_t cell_of(double u) noexcept {
    const double k = kCells * (1.0 - std::sqrt(1.0 - std::clamp(u, 0.0, 1.0)));
    return std::min(static_cast<std::size_t>(k), kCells - 1);
  }
  [[nodiscard]] double square(std::size_t k) const noexcept { return square_[k]; }  ///< W² at a node
  /// What |z| may be in a cell, whatever w is.
  [[nodiscard]] double jerk(std::size_t cell) const noexcept { return jerk_[cell]; }
  /// What |z| may be up to this |w|. The bound is concave in |w|, so a chord of it will do.
  [[nodiscard]] double jerk(std::size_t cell, double w) const noexcept {
    return even_jerk_[cell] - std::min(w, widest(cell)) * steepness_[cell];
  }
  [[nodiscard]] double widest(std::size_t cell) const noexcept {
    return std::sqrt(std::max(square_[cell], square_[cell + 1]));
  }
  /// The integral of 2 |z| over u from 0 on: to speed up or brake at that jerk from one u to another changes w² by the difference.
  [[nodiscard]] double energy(std::size_t cell, double u) const noexcept {
    return energy_[cell] + 2.0 * jerk_[cell] * (u - node(cell));
  }

 private:
  static std::array<Shares, kCells> everywhere(const Shares& most) noexcept {
    std::array<Shares, kCells> all;
    all.fill(most);
    return all;
  }

  std::array<double, kCells + 1> square_{}, energy_{};
  std::array<double, kCells> jerk_{}, even_jerk_{};  ///< bounds of |z| at the greatest |w| and at w = 0
  std::array<double, kCells> steepness_{};           ///< of the chord between them
};

/// Where virtual time is. From each instant it tends to the wanted rate as quickly as the curve allows, through states of constant z.
class RateGovernor {
 public:
  /// A motion begins, at this rate at once. `curve` must outlive it.
  void begin(const RateCurve& curve, double rate) noexcept {
    curve_ = whole_ = &curve;
    time_s_ = w_ = 0.0;
    u_ = std::clamp(rate, 0.0, 1.0);
    cell_ = RateCurve::cell_of(u_);
    seek(u_);
  }
  /// From now on: the override, or 0 to stop, to pause or to cancel. During stop() it waits until the arm rests.
  void seek(double rate) noexcept {
    sought_ = std::clamp(rate, 0.0, 1.0);
    if (!is_stopping()) want(sought_);
  }
  /// At rest at once, and from there to what was sought last: the arm has stood still.
  void halt() noexcept {
    u_ = w_ = 0.0;
    cell_ = 0;
    curve_ = whole_;
    want(sought_);
  }
  /// To rest by another curve, which must outlive the stop, and which allows no less than the present one: stop_curve().
  void stop(const RateCurve& quick) noexcept {
    curve_ = &quick;
    sought_ = 0.0;
    want(0.0);
  }
  [[nodiscard]] bool is_stopping() const noexcept { return curve_ != whole_; }  ///< by stop()
  /// For each cell of u, the virtual time from which on a stop that begins now is below the cell. It is the present one where it never comes.
  [[nodiscard]] std::array<double, RateCurve::kCells> stop_times_s() const noexcept {
    constexpr double kLongest_s = 1e3;
    std::array<double, RateCurve::kCells> times_s;
    times_s.fill(time_s_);
    RateGovernor other = *this;
    other.want(0.0);
    for (std::size_t i = 0; i < kMostWays && !other.is_at_rest(); ++i) {
      other.pass(kLongest_s);
      times_s[other.cell_] = other.time_s_;
    }
    return times_s;
  }
  void advance(double dt_s) noexcept {
    for (std::size_t i = 0; i < kMostWays && dt_s > 0.0; ++i) dt_s -= pass(dt_s);
  }

  [[nodiscard]] double time_s() const noexcept { return time_s_; }  ///< virtual
  [[nodiscard]] double rate() const noexcept { return u_; }
  [[nodiscard]] double change_1_s() const noexcept { return w_; }
  [[nodiscard]] bool is_at_rest() const noexcept { return u_ == 0.0 && w_ == 0.0; }

 private:
  /// A way in u at constant z, from here to the end of the cell at most.
  struct Way {
    double length;  ///< 0 or more
    double gain;    ///< of w² by length
  };
  void want(double rate) noexcept {
    wanted_ = rate;
    wanted_energy_ = curve_->energy(RateCurve::cell_of(rate), rate);
  }
  double pass(double most_s) noexcept;
  [[nodiscard]] Way way(double sign, double square) const noexcept;

  /// z is even in steps of |w|: parts of the greatest |w| in the cell. Those do not depend on where a cycle begins.
  static constexpr double kStep = 1.0 / 64.0;
  static constexpr double kSameStep = 1e-9;
  static constexpr double kSame = 1e-12;  ///< u that differ by rounding, and squares as a part
  /// More than there are steps in all cells. A millisecond takes about two.
  static constexpr std::size_t kMostWays = 128 * RateCurve::kCells;

  const RateCurve *curve_{}, *whole_{};  ///< the present one, and that of the whole motion
  double sought_{}, wanted_{}, wanted_energy_{};
  double u_{}, w_{}, time_s_{};
  std::size_t cell_{};
};

inline RateCurve::RateCurve(std::span<const RateLimit> limits,
                            const std::array<Shares, kCells>& most) noexcept {
  constexpr double kLeast = 1e-3;    // of a share: a motion that hardly moves stops in some milliseconds
  constexpr double kTurning = 0.75;  // part of the jerk that u |w| may take, for z must not vanish
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto width = [](std::size_t k) { return node(k + 1) - node(k); };
  // In a cell, by its upper end: what the jerk's limit leaves at w = 0, takes by |w|, and takes by |z|.
  struct Jerk {
    double left, by_w, by_z;
  };
  const auto jerk_of = [&](std::size_t k, const RateLimit& limit) {
    const double u = node(k + 1);
    return Jerk{1.0 - most[k].jerk * u * u * u,
                3.0 * most[k].acceleration * limit.acceleration / limit.jerk * u,
                std::max(most[k].speed, kLeast) * limit.speed / limit.jerk};
  };
  // The greatest |w| at one end of a cell, where w² at the other end is `square` at most.
  const auto greatest = [&](std::size_t k, double square) {
    const double u = node(k + 1), left = 1.0 - most[k].acceleration * u * u;
    double w = kInfinity;
    for (const RateLimit& limit : limits) {
      const Jerk jerk = jerk_of(k, limit);
      const double by_square = jerk.by_z / (2.0 * width(k)), c = jerk.left + by_square * square;
      w = std::min({w, left * limit.acceleration / (std::max(most[k].speed, kLeast) * limit.speed),
                    jerk.by_w > 0.0 ? kTurning * jerk.left / jerk.by_w : kInfinity,
                    2.0 * c / (jerk.by_w + std::sqrt(jerk.by_w * jerk.by_w + 4.0 * by_square * c))});
    }
    return w * w;
  };
  for (std::size_t k = kCells; k-- > 0;) square_[k] = greatest(k, square_[k + 1]);
  square_[0] = 0.0;
  for (std::size_t k = 0; k < kCells; ++k) {
    square_[k + 1] = std::min(square_[k + 1], greatest(k, square_[k]));
    jerk_[k] = even_jerk_[k] = kInfinity;
    for (const RateLimit& limit : limits) {
      const Jerk jerk = jerk_of(k, limit);
      even_jerk_[k] = std::min(even_jerk_[k], jerk.left / jerk.by_z);
      jerk_[k] = std::min(jerk_[k], (jerk.left - jerk.by_w * widest(k)) / jerk.by_z);
    }
    steepness_[k] = (even_jerk_[k] - jerk_[k]) / widest(k);
    energy_[k + 1] = energy_[k] + 2.0 * jerk_[k] * width(k);
  }
}

inline RateGovernor::Way RateGovernor::way(double sign, double square) const noexcept {
  const double low = RateCurve::node(cell_), high = RateCurve::node(cell_ + 1);
  const double end = std::max(0.0, sign > 0.0 ? high - u_ : u_ - low);
  const double w = std::abs(w_), step = kStep * curve_->widest(cell_);
  // From which it can still brake to the wanted rate; negative beyond it.
  const double sure = curve_->jerk(cell_), braking = sign * (wanted_energy_ - curve_->energy(cell_, u_));
  if (!(square <= braking * (1.0 + kSame))) {
    const double top = step * std::max(1.0, std::ceil(w / step - kSameStep)), bottom = top - step;
    const double z = curve_->jerk(cell_, top);
    return {std::clamp((square - bottom * bottom) / (2.0 * z), 0.0, end), -2.0 * z};
  }
  if (square >= braking * (1.0 - kSame)) return {std::min(end, square / (2.0 * sure)), -2.0 * sure};
  const double below = curve_->square(cell_), slope = (curve_->square(cell_ + 1) - below) / (high - low);
  const double most = below + slope * (u_ - low), along = sign * slope;
  if (square >= most * (1.0 - kSame)) {
    const double closing = 2.0 * sure + along;
    return {closing > 0.0 ? std::min(end, (braking - square) / closing) : end, along};
  }
  const double top = step * (1.0 + std::floor(w / step + kSameStep)), z = curve_->jerk(cell_, top);
  double length = std::min({end, (braking - square) / (2.0 * (z + sure)), (top * top - square) / (2.0 * z)});
  if (2.0 * z > along) length = std::min(length, (most - square) / (2.0 * z - along));
  return {length, 2.0 * z};
}

/// One way, or as much of it as this time takes; the time that it took.
inline double RateGovernor::pass(double most_s) noexcept {
  if (w_ == 0.0 && std::abs(u_ - wanted_) <= kSame) {
    u_ = wanted_;
    time_s_ += u_ * most_s;
    return most_s;
  }
  const double sign = w_ != 0.0 ? std::copysign(1.0, w_) : wanted_ > u_ ? 1.0 : -1.0;
  if (sign > 0.0 && u_ >= RateCurve::node(cell_ + 1) && cell_ + 1 < RateCurve::kCells) ++cell_;
  if (sign < 0.0 && u_ <= RateCurve::node(cell_) && cell_ > 0) --cell_;
  const double square = w_ * w_;
  const Way next = way(sign, square);
  const double then = std::sqrt(std::max(0.0, square + next.gain * next.length));
  const double z = sign * 0.5 * next.gain, sum = std::abs(w_) + then;
  const double takes_s = sum > 0.0 ? 2.0 * next.length / sum : 0.0, t_s = std::min(takes_s, most_s);
  time_s_ += t_s * (u_ + t_s * (w_ / 2.0 + t_s * z / 6.0));
  if (takes_s > most_s) {
    u_ += t_s * (w_ + t_s * z / 2.0);
    w_ += t_s * z;
    return t_s;
  }
  u_ += sign * next.length;
  w_ = sign * then;
  // What rounding leaves where it comes to rest.
  const double rounding = kSame * kSame + 4e-16 * curve_->energy(RateCurve::kCells - 1, 1.0);
  const bool is_there = std::abs(u_ - wanted_) <= kSame && then * then <= rounding;
  if (is_there || u_ <= 0.0 || u_ >= 1.0) w_ = 0.0;
  u_ = is_there ? wanted_ : std::clamp(u_, 0.0, 1.0);
  if (is_at_rest()) {
    curve_ = whole_;
    want(sought_);
  }
  return t_s;
}

/// A curve for RateGovernor::stop(), by the pieces that a stop passes while u is in a cell. A quicker stop is below each cell earlier, which
/// is looked at, so it passes fewer of them. `whole`: by all pieces. `shares`: one for each piece, of these limits. Takes 0.1 ms or so.
[[nodiscard]] inline RateCurve stop_curve(const RateGovernor& governor, const RateCurve& whole,
                                          const RatePieces& law, std::span<const Shares> shares,
                                          std::span<const RateLimit> limits) noexcept {
  constexpr int kPasses = 3;
  constexpr double kRounding_s = 1e-12;
  RateCurve best = whole;
  std::array<double, RateCurve::kCells> until_s = governor.stop_times_s();
  for (int pass = 0; pass < kPasses; ++pass) {
    std::size_t piece = law.piece_at(governor.time_s());
    Shares most = shares[piece];
    std::array<Shares, RateCurve::kCells> ahead;
    for (std::size_t k = RateCurve::kCells; k-- > 0; ahead[k] = most) {
      while (piece + 1 < law.pieces.size() && law.pieces[piece + 1].begin_s <= until_s[k] + kRounding_s)
        most = greater(most, shares[++piece]);
    }
    const RateCurve curve(limits, ahead);
    RateGovernor quick = governor;
    quick.stop(curve);
    const std::array<double, RateCurve::kCells> quick_s = quick.stop_times_s();
    for (std::size_t k = 0; k < quick_s.size(); ++k) {
      if (quick_s[k] > until_s[k] + kRounding_s) return best;
    }
    best = curve;
    until_s = quick_s;
  }
  return best;
}

}  // namespace corbot::rate
