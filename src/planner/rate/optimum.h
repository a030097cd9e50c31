// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "planner/rate/geometry.h"
#include "planner/rate/pieces.h"
#include "planner/rate/proof.h"

// The quickest rate along a path, on a grid.

namespace corbot::rate {

/// lambda = G(mu), which goes as mu³ at both ends: so rest is a constant positive rate of mu, at which nothing is singular.
class Ramp {
 public:
  /// `length_s`: of lambda. `ramp_s`: how far the slope takes to reach 1, cut to half of the whole.
  Ramp(double length_s, double ramp_s) noexcept;
  [[nodiscard]] double length_mu() const noexcept { return length_mu_; }
  [[nodiscard]] double ramp_mu() const noexcept { return ramp_mu_; }
  /// G and its first three derivatives.
  [[nodiscard]] std::array<double, 4> at(double mu) const noexcept;
  /// To 1e-12 of the whole.
  [[nodiscard]] double mu_at(double lambda_s) const noexcept;

 private:
  double length_s_, length_mu_, ramp_mu_;
};

/// Minimises the time on 64 to 112 cells, whose limits are kept at the nodes (speed, acceleration) and in the middles (jerk); between
/// them they are exceeded by a few per cent, which prove() finds and stretch() repairs. One run of an interior-point method
/// whose iterates all keep the limits of the grid, in at most 30 steps; each step is a Riccati recursion.
/// Verscheure et al., IEEE TAC 54(10), 2009, for the unknowns b = mu′², a = mu″; the jerk's limit is renewed by its tangent in each step.
[[nodiscard]] RateLaw optimum(std::span<const Knot> knots, const Limits& limits);

}  // namespace corbot::rate
