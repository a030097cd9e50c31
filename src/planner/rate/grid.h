// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "planner/rate/geometry.h"
#include "planner/rate/proof.h"

// A path's limits on a grid, as rows that are linear in the unknowns of its rate.

namespace corbot::rate {

/// The map lambda = G(mu), which behaves like mu³ at both ends. Rest is therefore a constant positive rate of
/// mu, at which nothing is singular.
class Ramp {
 public:
  /// `length_s`: length in lambda. `ramp_s`: length over which the slope reaches 1, at most half of the
  /// whole.
  Ramp(double length_s, double ramp_s) noexcept;
  [[nodiscard]] double length_mu() const noexcept { return length_mu_; }
  [[nodiscard]] double ramp_mu() const noexcept { return ramp_mu_; }
  /// Returns G and its first three derivatives.
  [[nodiscard]] std::array<double, 4> at(double mu) const noexcept;
  /// Returns mu to 1e-12 of the whole.
  [[nodiscard]] double mu_at(double lambda_s) const noexcept;

 private:
  double length_s_, length_mu_, ramp_mu_;
};

inline constexpr std::size_t kDirections = 6;  ///< of an arc's vectors, two-sided: a 12-sided polygon
inline constexpr std::size_t kMostRows = kMaxJoints + 1 + kDirections;

/// The limit |b·x0 + a·x1 + w·x2| <= 1 at a node, <= b_m^(−1/2) in a middle, with slacks and duals of both
/// sides.
struct Row {
  std::array<double, 3> x{};
  std::array<double, 2> slack{}, dual{};
};

/// A node and the cell after it. At the node b = mu′² and a = mu″; in the cell w = da/d mu. The next node's b
/// and a are linear in them.
struct Stage {
  double h{}, weight{};  ///< h: length of the cell; weight: of b^(−1/2) in the time
  double most_b{}, speed_slack{}, speed_dual{};
  std::array<Row, kMostRows> acceleration{}, jerk{};
  std::size_t count{};  ///< of each kind
  bool has_jerk{};
  double b{}, a{}, w{};
  double db{}, da{}, dw{};

  [[nodiscard]] double middle_b() const noexcept { return b + h * a + 0.25 * h * h * w; }
  [[nodiscard]] double middle_db() const noexcept { return db + h * da + 0.25 * h * h * dw; }
};

/// A grid of 64 to 112 cells, which are smaller where the curve bends and near rest.
struct Grid {
  Grid(std::span<const Knot> knots, const Limits& limits);

  std::vector<double> lambda_s;  ///< at the nodes
  std::vector<Stage> stages;     ///< one for each node; b, a and w are 0
};

}  // namespace corbot::rate
