// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "planner/rate/grid.h"
#include "planner/rate/pieces.h"
#include "planner/rate/proof.h"

// The quickest rate along a path, on a grid.

namespace corbot::rate {

/// Minimises the time. The limits are kept at the nodes (speed, acceleration) and in the middles of the cells (jerk). Between them they
/// are exceeded by a few per cent, which prove() finds, tighten() takes back, and stretch() repairs.
/// An interior-point method whose iterates all keep the limits of the grid; each step is a Riccati recursion.
/// Verscheure et al., IEEE TAC 54(10), 2009, for the unknowns b = mu′², a = mu″; the jerk's limit is renewed by its tangent in each step.
class Optimum {
 public:
  /// Begins at a constant mu′, half of the greatest.
  explicit Optimum(Grid grid);

  /// `gap`: part of the time by which the answer may be off. At most 30 steps.
  void run(double gap);
  /// The present rate; one piece for each cell.
  [[nodiscard]] RateLaw law() const;
  /// Limits of the cells whose proved shares are beyond 1 shrink by that, and by a tenth of the excess. The rate is slowed to keep them.
  void tighten(std::span<const Shares> shares);

 private:
  template <class F>
  void each(F&& f);
  void find_slacks() noexcept;
  void set_duals(double part) noexcept;
  [[nodiscard]] double time_s() const noexcept;
  void solve(double tau);
  void advance(double tau, double primal, double dual);

  Grid grid_;
  double rows_{};  ///< their number
};

}  // namespace corbot::rate
