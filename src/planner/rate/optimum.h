// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "planner/rate/grid.h"
#include "planner/rate/pieces.h"
#include "planner/rate/proof.h"

// The quickest rate along a path, on a grid.

namespace corbot::rate {

/// Minimises the time. The rate keeps the limits at the nodes (speed, acceleration) and in the middles of the
/// cells (jerk). Between them it exceeds the limits by a few per cent. prove() finds the excess, tighten()
/// reduces it, and stretch() removes the rest.
/// The method is an interior-point method whose iterates all keep the limits of the grid; each step is a
/// Riccati recursion. The unknowns are b = mu′², a = mu″, as in Verscheure et al., IEEE TAC 54(10), 2009.
/// Each step linearises the jerk's limit anew.
class Optimum {
 public:
  /// Begins at a constant mu′, half of the greatest.
  explicit Optimum(Grid grid);

  /// `gap`: largest error of the result, as a part of the time. At most 30 steps.
  void run(double gap);
  /// Returns the present rate, with one piece for each cell.
  [[nodiscard]] RateLaw law() const;
  /// Reduces the limits of cells whose proved shares exceed 1 by the excess and a tenth of it. Slows the rate
  /// down to keep the new limits.
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
  double rows_{};  ///< number of rows
};

}  // namespace corbot::rate
