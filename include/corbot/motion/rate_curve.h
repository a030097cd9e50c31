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

// Stop, pause, override and cancellation along a path. A motion is a function of virtual time, which passes
// at a rate u of 0 to 1. At u = 1 the motion reaches at most the shares V, A, J of each of its limits v, a,
// j. Let w = du/dt and z = dw/dt. Its derivatives by real time have the bounds
//   `V v u`, `A a u² + V v |w|` and `J j u³ + 3 A a u |w| + V v |z|`.
// So each u(t) keeps all limits, at any place, if everywhere
//   `A u² + V v/a |w| <= 1` and `J u³ + 3 A a/j u |w| + V v/j |z| <= 1`.
// The functions and classes are real-time safe.

namespace corbot::rate {

/// Shares of the speed, acceleration and jerk limits; 1 is the limit.
struct Shares {
  double speed{}, acceleration{}, jerk{};
};

[[nodiscard]] inline Shares greater(const Shares& x, const Shares& y) noexcept {
  return {std::max(x.speed, y.speed), std::max(x.acceleration, y.acceleration), std::max(x.jerk, y.jerk)};
}

/// The full limits of one quantity that a motion moves; finite and positive.
struct RateLimit {
  double speed{}, acceleration{}, jerk{};
};

/// Bounds the change of u: |w| <= W(u), by cells of u. In each cell |z| has one bound, and W² is linear.
/// Nowhere does W² rise or fall faster than the bound of |z| allows, so a permitted way leads from any
/// permitted (u, w) to rest.
class RateCurve {
 public:
  static constexpr std::size_t kCells = 128;
  static constexpr std::size_t kMostLimits = kMaxJoints + 2;

  /// `most`: shares that the motion reaches; those of acceleration and jerk below 1. At most kMostLimits
  /// limits.
  RateCurve(std::span<const RateLimit> limits, const Shares& most) noexcept
      : RateCurve(limits, everywhere(most)) {}
  /// `most`: the shares that the motion reaches while u is in a cell.
  RateCurve(std::span<const RateLimit> limits, const std::array<Shares, kCells>& most) noexcept;

  /// Returns u at the beginning of cell k. The cells are narrower towards 1, where little is left of the
  /// limits.
  [[nodiscard]] static double node(std::size_t k) noexcept {
    const double rest = 1.0 - static_cast<double>(k) / kCells;
    return 1.0 - rest * rest;
  }
  [[nodiscard]] static std::size_t cell_of(double u) noexcept {
    const double k = kCells * (1.0 - std::sqrt(1.0 - std::clamp(u, 0.0, 1.0)));
    return std::min(static_cast<std::size_t>(k), kCells - 1);
  }
  [[nodiscard]] double square(std::size_t k) const noexcept { return square_[k]; }  ///< W² at a node
  /// Returns the bound of |z| in a cell for any w.
  [[nodiscard]] double jerk(std::size_t cell) const noexcept { return jerk_[cell]; }
  /// Returns the bound of |z| up to this |w|. The bound is concave in |w|, so a chord of it is safe.
  [[nodiscard]] double jerk(std::size_t cell, double w) const noexcept {
    return even_jerk_[cell] - std::min(w, widest(cell)) * steepness_[cell];
  }
  [[nodiscard]] double widest(std::size_t cell) const noexcept {
    return std::sqrt(std::max(square_[cell], square_[cell + 1]));
  }
  /// Returns the integral of 2 |z| over u from 0 on. Speeding up or braking at that jerk from one u to
  /// another changes w² by the difference.
  [[nodiscard]] double energy(std::size_t cell, double u) const noexcept {
    return energy_[cell] + 2.0 * jerk_[cell] * (u - node(cell));
  }

  [[nodiscard]] static std::array<Shares, kCells> everywhere(const Shares& most) noexcept {
    std::array<Shares, kCells> all;
    all.fill(most);
    return all;
  }

 private:
  friend class CurveSteps;
  RateCurve() = default;

  std::array<double, kCells + 1> square_{}, energy_{};
  std::array<double, kCells> jerk_{}, even_jerk_{};  ///< bounds of |z| at the greatest |w| and at w = 0
  std::array<double, kCells> steepness_{};           ///< steepness of the chord between them
};

/// Computes a RateCurve in steps, some in each call: the task has no time for all of them in one cycle.
class CurveSteps {
 public:
  static constexpr std::size_t kSteps = 2 * RateCurve::kCells;

  CurveSteps() = default;
  /// Takes the arguments of RateCurve.
  CurveSteps(std::span<const RateLimit> limits, const std::array<Shares, RateCurve::kCells>& most) noexcept;
  /// Does `count` steps. True: the curve is complete.
  [[nodiscard]] bool step(std::size_t count) noexcept;
  [[nodiscard]] const RateCurve& curve() const noexcept { return curve_; }

 private:
  /// The least share: a motion that hardly moves stops in some milliseconds.
  static constexpr double kLeast = 1e-3;
  /// The part of the jerk that u |w| may take, for z must not vanish.
  static constexpr double kTurning = 0.75;
  /// The jerk's limit in a cell, at its upper end: the rest at w = 0, the part per |w|, and the part per |z|.
  struct Jerk {
    double left, by_w, by_z;
  };
  [[nodiscard]] static double width(std::size_t k) noexcept {
    return RateCurve::node(k + 1) - RateCurve::node(k);
  }
  [[nodiscard]] Jerk jerk_of(std::size_t k, const RateLimit& limit) const noexcept;
  /// Returns the square of the greatest |w| at one end of a cell, if w² at the other end is `square` at most.
  [[nodiscard]] double greatest(std::size_t k, double square) const noexcept;
  void rise(std::size_t k) noexcept;

  std::array<RateLimit, RateCurve::kMostLimits> limits_{};
  std::size_t count_{};
  std::array<Shares, RateCurve::kCells> most_{};
  std::size_t next_{};  ///< steps from u = 1 down, then up again
  RateCurve curve_;
};

/// Advances virtual time. From each instant it tends to the wanted rate as quickly as the curve allows,
/// through states of constant z.
class RateGovernor {
 public:
  /// Begins a motion, at this rate at once. `curve` must outlive it.
  void begin(const RateCurve& curve, double rate) noexcept {
    curve_ = whole_ = &curve;
    time_s_ = w_ = 0.0;
    u_ = std::clamp(rate, 0.0, 1.0);
    cell_ = RateCurve::cell_of(u_);
    seek(u_);
  }
  /// Sets the rate from now on: the override, or 0 to stop, to pause or to cancel. During stop() it waits
  /// until the arm rests.
  void seek(double rate) noexcept {
    sought_ = std::clamp(rate, 0.0, 1.0);
    if (!is_stopping()) want(sought_);
  }
  /// Sets the rate to rest at once, and seeks the last rate from there: the arm has stood still.
  void halt() noexcept {
    u_ = w_ = 0.0;
    cell_ = 0;
    curve_ = whole_;
    want(sought_);
  }
  /// Goes to rest by another curve, which must outlive the stop and allow no less than the present one:
  /// StopSearch.
  void stop(const RateCurve& quick) noexcept {
    curve_ = &quick;
    sought_ = 0.0;
    want(0.0);
  }
  [[nodiscard]] bool is_stopping() const noexcept { return curve_ != whole_; }  ///< in a stop by stop()
  void advance(double dt_s) noexcept {
    std::size_t ways = kMostWays;
    (void)advance(dt_s, ways);
  }
  /// Advances by at most `ways` states of constant z, and counts them down. Returns the time that is left.
  [[nodiscard]] double advance(double dt_s, std::size_t& ways) noexcept {
    for (; ways > 0 && dt_s > 0.0; --ways) dt_s -= pass(dt_s);
    return dt_s;
  }

  [[nodiscard]] double time_s() const noexcept { return time_s_; }  ///< virtual
  [[nodiscard]] double rate() const noexcept { return u_; }
  [[nodiscard]] double change_1_s() const noexcept { return w_; }
  [[nodiscard]] bool is_at_rest() const noexcept { return u_ == 0.0 && w_ == 0.0; }
  /// Tells whether both are at the same place, at the same rate, and on the way to the same rate.
  [[nodiscard]] bool is_as(const RateGovernor& other) const noexcept {
    return curve_ == other.curve_ && wanted_ == other.wanted_ && u_ == other.u_ && w_ == other.w_ &&
           time_s_ == other.time_s_;
  }

 private:
  friend class StopTimes;
  /// A way in u at constant z, from here to the end of the cell at most.
  struct Way {
    double length;  ///< 0 or more
    double gain;    ///< change of w² per length
  };
  void want(double rate) noexcept {
    wanted_ = rate;
    wanted_energy_ = curve_->energy(RateCurve::cell_of(rate), rate);
  }
  double pass(double most_s) noexcept;
  [[nodiscard]] Way way(double sign, double square) const noexcept;

  /// z is constant in steps of |w|: parts of the greatest |w| in the cell. The steps do not depend on where a
  /// cycle begins.
  static constexpr double kStep = 1.0 / 64.0;
  static constexpr double kSameStep = 1e-9;
  static constexpr double kSame = 1e-12;  ///< u that differ by rounding; for squares a relative part
  /// A bound above the number of steps in all cells. A millisecond takes about two.
  static constexpr std::size_t kMostWays = 128 * RateCurve::kCells;

  const RateCurve *curve_{}, *whole_{};  ///< the present curve, and that of the whole motion
  double sought_{}, wanted_{}, wanted_energy_{};
  double u_{}, w_{}, time_s_{};
  std::size_t cell_{};
};

/// Holds for each cell of u the virtual time from which on a stop is below the cell. It is the time of the
/// request if the stop never goes below the cell.
class StopTimes {
 public:
  StopTimes() = default;
  /// Begins a stop that is requested here.
  explicit StopTimes(const RateGovernor& from) noexcept : governor_(from) {
    governor_.want(0.0);
    times_s_.fill(from.time_s_);
  }
  /// Advances by some ways of the governor. True: it is at rest.
  [[nodiscard]] bool step(std::size_t ways) noexcept {
    constexpr double kLongest_s = 1e3;
    for (; ways > 0 && !governor_.is_at_rest(); --ways) {
      governor_.pass(kLongest_s);
      times_s_[governor_.cell_] = governor_.time_s_;
    }
    return governor_.is_at_rest();
  }
  [[nodiscard]] const std::array<double, RateCurve::kCells>& times_s() const noexcept { return times_s_; }

 private:
  RateGovernor governor_;
  std::array<double, RateCurve::kCells> times_s_{};
};

inline RateCurve::RateCurve(std::span<const RateLimit> limits,
                            const std::array<Shares, kCells>& most) noexcept {
  CurveSteps steps(limits, most);
  (void)steps.step(CurveSteps::kSteps);
  *this = steps.curve();
}

/// Drops a limit with smaller v/a and a/j than another: everything that the curve takes from limits grows
/// with these.
inline CurveSteps::CurveSteps(std::span<const RateLimit> limits,
                              const std::array<Shares, RateCurve::kCells>& most) noexcept
    : most_(most) {
  const auto is_within = [](const RateLimit& x, const RateLimit& y) {
    return x.speed * y.acceleration <= y.speed * x.acceleration &&
           x.acceleration * y.jerk <= y.acceleration * x.jerk;
  };
  for (const RateLimit& limit : limits) {
    const auto end = limits_.begin() + static_cast<std::ptrdiff_t>(count_);
    if (std::any_of(limits_.begin(), end, [&](const RateLimit& other) { return is_within(limit, other); }))
      continue;
    const auto left =
        std::remove_if(limits_.begin(), end, [&](const RateLimit& other) { return is_within(other, limit); });
    count_ = static_cast<std::size_t>(left - limits_.begin());
    limits_[count_++] = limit;
  }
}

inline bool CurveSteps::step(std::size_t count) noexcept {
  for (; count > 0 && next_ < kSteps; --count, ++next_) {
    if (next_ < RateCurve::kCells) {
      const std::size_t k = RateCurve::kCells - 1 - next_;
      curve_.square_[k] = k == 0 ? 0.0 : greatest(k, curve_.square_[k + 1]);
    } else {
      rise(next_ - RateCurve::kCells);
    }
  }
  return next_ == kSteps;
}

inline CurveSteps::Jerk CurveSteps::jerk_of(std::size_t k, const RateLimit& limit) const noexcept {
  const double u = RateCurve::node(k + 1);
  return {1.0 - most_[k].jerk * u * u * u, 3.0 * most_[k].acceleration * limit.acceleration / limit.jerk * u,
          std::max(most_[k].speed, kLeast) * limit.speed / limit.jerk};
}

inline double CurveSteps::greatest(std::size_t k, double square) const noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double u = RateCurve::node(k + 1), left = 1.0 - most_[k].acceleration * u * u;
  double w = kInfinity;
  for (const RateLimit& limit : std::span(limits_.data(), count_)) {
    const Jerk jerk = jerk_of(k, limit);
    const double by_square = jerk.by_z / (2.0 * width(k)), c = jerk.left + by_square * square;
    w = std::min({w, left * limit.acceleration / (std::max(most_[k].speed, kLeast) * limit.speed),
                  jerk.by_w > 0.0 ? kTurning * jerk.left / jerk.by_w : kInfinity,
                  2.0 * c / (jerk.by_w + std::sqrt(jerk.by_w * jerk.by_w + 4.0 * by_square * c))});
  }
  return w * w;
}

inline void CurveSteps::rise(std::size_t k) noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  RateCurve& c = curve_;
  c.square_[k + 1] = std::min(c.square_[k + 1], greatest(k, c.square_[k]));
  c.jerk_[k] = c.even_jerk_[k] = kInfinity;
  for (const RateLimit& limit : std::span(limits_.data(), count_)) {
    const Jerk jerk = jerk_of(k, limit);
    c.even_jerk_[k] = std::min(c.even_jerk_[k], jerk.left / jerk.by_z);
    c.jerk_[k] = std::min(c.jerk_[k], (jerk.left - jerk.by_w * c.widest(k)) / jerk.by_z);
  }
  c.steepness_[k] = (c.even_jerk_[k] - c.jerk_[k]) / c.widest(k);
  c.energy_[k + 1] = c.energy_[k] + 2.0 * c.jerk_[k] * width(k);
}

inline RateGovernor::Way RateGovernor::way(double sign, double square) const noexcept {
  const double low = RateCurve::node(cell_), high = RateCurve::node(cell_ + 1);
  const double end = std::max(0.0, sign > 0.0 ? high - u_ : u_ - low);
  const double w = std::abs(w_), step = kStep * curve_->widest(cell_);
  // From `braking` on it can still brake to the wanted rate; negative beyond it.
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

/// Passes one way, or as much of it as this time allows. Returns the time that it took.
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
  // The rounding that is left when it comes to rest.
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

}  // namespace corbot::rate
