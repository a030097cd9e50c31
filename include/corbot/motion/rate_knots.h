// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "corbot/kinematics/joints.h"
#include "corbot/motion/rate_pieces.h"

// A line or an arc as a curve z = (q, s) of joints and path parameter, by its length lambda. Lengths are
// measured in the time that full speed takes: d lambda² = Σ (dq_i / v_i)² + (ds / v_s)², v the full speeds.
// So lambda counts in seconds, and |dz_i / d lambda| <= v_i everywhere. Next to a singularity q behaves as
// √s, hence s as lambda²: z is smooth in lambda there, too. Real-time safe.

namespace corbot {

inline constexpr std::size_t kMostKnots = 96;  ///< of one path
/// The farthest that a joint may go between two knots (rad or m): planner and real-time task check a few
/// points in between.
inline constexpr double kLongestStep_q = 0.5;

}  // namespace corbot

namespace corbot::rate {

/// Joints (rad or m), zeros beyond the arm's, then the path parameter s in [0, 1].
using State = std::array<double, kMaxJoints + 1>;
inline constexpr std::size_t kPath = kMaxJoints;  ///< index of s

struct Knot {
  double lambda_s{};
  State z{};
  State rate{};  ///< dz/d lambda, of length 1 in the metric above
  State bend{};  ///< d²z/d lambda²
};
static_assert(std::is_trivially_copyable_v<Knot> && sizeof(Knot) % 8 == 0);

/// The polynomials of the fifth degree between two knots that match both with two derivatives.
class Cell {
 public:
  Cell(const Knot& a, const Knot& b) noexcept : Cell(a, b, b.lambda_s - a.lambda_s) {}
  /// `length_s` replaces the difference of the knots' lambda; positive.
  Cell(const Knot& a, const Knot& b, double length_s) noexcept;

  [[nodiscard]] double length_s() const noexcept { return length_s_; }
  /// Σ c[k]·t^k
  [[nodiscard]] const std::array<double, 6>& polynomial(std::size_t i) const noexcept { return c_[i]; }
  /// `t`: part of the cell, 0 … 1. `order`: order of the derivative by lambda, 0 … 5.
  [[nodiscard]] State at(double t, std::size_t order = 0) const noexcept;

 private:
  double length_s_;
  std::array<std::array<double, 6>, kMaxJoints + 1> c_{};  ///< Σ c[k]·t^k
};

inline Cell::Cell(const Knot& a, const Knot& b, double length_s) noexcept : length_s_(length_s) {
  const double h = length_s;
  for (std::size_t i = 0; i < c_.size(); ++i) {
    std::array<double, 6>& c = c_[i];
    c[0] = a.z[i];
    c[1] = h * a.rate[i];
    c[2] = 0.5 * h * h * a.bend[i];
    // The rest of value, first and second derivative at t = 1.
    const double value = (b.z[i] - a.z[i]) - c[1] - c[2];
    const double rate = h * b.rate[i] - c[1] - 2.0 * c[2];
    const double bend = h * h * b.bend[i] - 2.0 * c[2];
    c[3] = 10.0 * value - 4.0 * rate + 0.5 * bend;
    c[4] = -15.0 * value + 7.0 * rate - bend;
    c[5] = 6.0 * value - 3.0 * rate + 0.5 * bend;
  }
}

inline State Cell::at(double t, std::size_t order) const noexcept {
  State x{};
  std::array<double, 6> factor{};  // k!/(k − order)!
  double scale = 1.0;
  for (std::size_t m = 0; m < order; ++m) scale /= length_s_;
  for (std::size_t k = order; k < factor.size(); ++k) {
    factor[k] = scale;
    for (std::size_t m = 0; m < order; ++m) factor[k] *= static_cast<double>(k - m);
  }
  for (std::size_t i = 0; i < c_.size(); ++i) {
    for (std::size_t k = factor.size(); k-- > order;) x[i] = x[i] * t + factor[k] * c_[i][k];
  }
  return x;
}

/// A line or an arc as the task follows it. Others own the memory.
struct RatePath {
  std::span<const Knot> knots;
  RatePieces law;  ///< to the last knot's lambda
};

/// Returns the number of the cell in which lambda lies. At least two knots.
[[nodiscard]] inline std::size_t cell_at(std::span<const Knot> knots, double lambda_s) noexcept {
  const auto inner = knots.subspan(1, knots.size() - 2);
  const auto next = std::upper_bound(inner.begin(), inner.end(), lambda_s,
                                     [](double x, const Knot& knot) { return x < knot.lambda_s; });
  return static_cast<std::size_t>(next - inner.begin());
}

/// Returns z at lambda, clamped to the knots; exact at both ends. At least two knots.
[[nodiscard]] inline State state_at(std::span<const Knot> knots, double lambda_s) noexcept {
  if (!(lambda_s > knots.front().lambda_s)) return knots.front().z;
  if (lambda_s >= knots.back().lambda_s) return knots.back().z;
  const std::size_t i = cell_at(knots, lambda_s);
  const Cell cell(knots[i], knots[i + 1]);
  return cell.at((lambda_s - knots[i].lambda_s) / cell.length_s());
}

}  // namespace corbot::rate
