// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "corbot/kinematics/joints.h"

// Lines and arcs of arms without a closed form: the joints as a function of the path parameter s, polynomials of the fifth degree
// between knots, twice continuously differentiable. Like a closed form this is a function of s alone, so that stops, pauses and
// overrides run along it as along any path. Real-time safe.

namespace corbot {

/// Joints at a point of the path, and their derivatives by its parameter.
struct PathKnot {
  double s;
  Joints q;
  Joints rate_q;  ///< dq/ds
  Joints bend_q;  ///< d²q/ds²
};
static_assert(std::is_trivially_copyable_v<PathKnot> && sizeof(PathKnot) % 8 == 0);

/// Of one path; the first has s = 0, the last s = 1.
inline constexpr std::size_t kMostKnots = 96;
/// A joint may not go farther from one knot to the next (rad or m): planner and real-time task look at a few points in between.
inline constexpr double kLongestPiece_q = 0.5;

using PathKnots = std::span<const PathKnot>;

/// The joints between two knots: Σ c[k]·t^k, t = 0 … 1.
class KnotPiece {
 public:
  static constexpr std::size_t kDegree = 5;
  using Polynomial = std::array<double, kDegree + 1>;

  KnotPiece(const PathKnot& a, const PathKnot& b) noexcept : begin_(a.s), length_(b.s - a.s) {
    const double h = length_;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      Polynomial& c = c_[i];
      c[0] = a.q[i];
      c[1] = h * a.rate_q[i];
      c[2] = 0.5 * h * h * a.bend_q[i];
      // What is left of value, first and second derivative at t = 1.
      const double value = (b.q[i] - a.q[i]) - c[1] - c[2];
      const double rate = h * b.rate_q[i] - c[1] - 2.0 * c[2];
      const double bend = h * h * b.bend_q[i] - 2.0 * c[2];
      c[3] = 10.0 * value - 4.0 * rate + 0.5 * bend;
      c[4] = -15.0 * value + 7.0 * rate - bend;
      c[5] = 6.0 * value - 3.0 * rate + 0.5 * bend;
    }
  }

  /// `t`: part of the piece.
  [[nodiscard]] Joints at(double t) const noexcept {
    Joints q{};
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      const Polynomial& c = c_[i];
      q[i] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    }
    return q;
  }
  [[nodiscard]] double begin_s() const noexcept { return begin_; }
  [[nodiscard]] double length_s() const noexcept { return length_; }
  [[nodiscard]] const Polynomial& polynomial(std::size_t joint) const noexcept { return c_[joint]; }

 private:
  double begin_, length_;
  std::array<Polynomial, kMaxJoints> c_{};
};

/// Number of the piece in which s lies. At least two knots.
[[nodiscard]] inline std::size_t piece_at(PathKnots knots, double s) noexcept {
  const auto inner = knots.subspan(1, knots.size() - 2);
  const auto next = std::upper_bound(inner.begin(), inner.end(), s,
                                     [](double x, const PathKnot& knot) { return x < knot.s; });
  return static_cast<std::size_t>(next - inner.begin());
}

/// The joints at s, clamped to 0 … 1; exact at both ends. At least two knots.
[[nodiscard]] inline Joints joints_at(PathKnots knots, double s) noexcept {
  if (!(s > 0.0)) return knots.front().q;
  if (s >= 1.0) return knots.back().q;
  const std::size_t i = piece_at(knots, s);
  const KnotPiece piece(knots[i], knots[i + 1]);
  return piece.at((s - piece.begin_s()) / piece.length_s());
}

}  // namespace corbot
