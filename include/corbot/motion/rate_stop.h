// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_pieces.h"

namespace corbot::rate {

/// Computes the state of a stop some cycles ahead: exactly the state to which RateGovernor::advance() leads
/// in each of them. A cycle of a slow motion's stop has many states of constant z, so one cycle has no time
/// for all of them. Real-time safe.
class StopAhead {
 public:
  static constexpr std::size_t kWays = 64;  ///< states of one call

  void begin(const RateGovernor& from, int cycles, double dt_s) noexcept {
    governor_ = from;
    cycles_ = cycles;
    left_s_ = dt_s_ = dt_s;
  }
  /// Does one call's states. True: it has arrived.
  [[nodiscard]] bool step() noexcept {
    for (std::size_t ways = kWays; cycles_ > 0; --cycles_, left_s_ = dt_s_) {
      left_s_ = governor_.advance(left_s_, ways);
      if (left_s_ > 0.0) return false;
    }
    return true;
  }
  [[nodiscard]] bool is_there() const noexcept { return cycles_ == 0; }
  [[nodiscard]] const RateGovernor& governor() const noexcept { return governor_; }

 private:
  RateGovernor governor_;
  int cycles_{0};  ///< cycles that are left, with the present one
  double dt_s_{0.0}, left_s_{0.0};
};

/// Searches a curve for RateGovernor::stop(), from the pieces that a stop passes while u is in a cell. A
/// quicker stop is below each cell earlier, which is checked, so it passes fewer pieces. A call does some
/// steps: the task has no time for all of them in one cycle. Real-time safe.
class StopSearch {
 public:
  /// So many calls of step() are enough for nearly all searches.
  static constexpr int kCalls = 14;

  StopSearch() = default;
  StopSearch(const StopSearch&) = delete;
  StopSearch& operator=(const StopSearch&) = delete;

  /// Begins a search. `from`: the beginning of the search's stop; it may be in a stop already. `shares`: one
  /// for each piece, of these limits. They outlive the search.
  void begin(const RateGovernor& from, const RatePieces& law, std::span<const Shares> shares,
             std::span<const RateLimit> limits) noexcept {
    from_ = from;
    law_ = law;
    shares_ = shares;
    limits_ = limits;
    found_.reset();
    times_ = StopTimes(from);
    task_ = Task::kSlowTimes;
  }
  /// Does one call's steps. True: the search has ended.
  [[nodiscard]] bool step() noexcept {
    switch (task_) {
      case Task::kSlowTimes:
        if (!times_.step(kWays)) return false;
        until_s_ = times_.times_s();
        // A stop that reaches the motion's end before it rests would only get there later.
        task_ = until_s_[0] < law_.duration_s ? Task::kShares : Task::kNone;
        return false;
      case Task::kShares:
        curve_ = CurveSteps(limits_, shares_ahead());
        task_ = Task::kCurve;
        return false;
      case Task::kCurve:
        if (curve_.step(kCurveSteps)) begin_times();
        return false;
      case Task::kQuickTimes:
        if (times_.step(kWays)) take();
        return false;
      case Task::kNone:
        break;
    }
    return true;
  }
  /// Returns null if no known curve is quicker than the one by which the stop began.
  [[nodiscard]] const RateCurve* found() const noexcept { return found_ ? &*found_ : nullptr; }

 private:
  static constexpr std::size_t kWays = StopAhead::kWays;
  static constexpr std::size_t kCurveSteps = 64;  // of one call
  enum class Task { kNone, kSlowTimes, kShares, kCurve, kQuickTimes };

  /// Returns the shares of the pieces from here to where u leaves each cell. Cells that u does not reach
  /// limit nothing. The curve before may have allowed more there, since it ran over other pieces.
  [[nodiscard]] std::array<Shares, RateCurve::kCells> shares_ahead() const noexcept {
    std::size_t piece = law_.piece_at(from_.time_s());
    Shares most = shares_[piece];
    std::array<Shares, RateCurve::kCells> ahead;
    const std::size_t cell = RateCurve::cell_of(from_.rate());
    for (std::size_t k = RateCurve::kCells; k-- > 0;) {
      while (piece + 1 < law_.pieces.size() && law_.pieces[piece + 1].begin_s <= until_s_[k] + kRounding_s)
        most = greater(most, shares_[++piece]);
      ahead[k] = k <= cell || until_s_[k] > from_.time_s() ? most : Shares{};
    }
    return ahead;
  }
  void begin_times() noexcept {
    RateGovernor quick = from_;
    quick.stop(curve_.curve());
    times_ = StopTimes(quick);
    task_ = Task::kQuickTimes;
  }
  void take() noexcept {
    task_ = Task::kNone;
    for (std::size_t k = 0; k < until_s_.size(); ++k) {
      if (times_.times_s()[k] > until_s_[k] + kRounding_s) return;
    }
    found_ = curve_.curve();
  }

  static constexpr double kRounding_s = 1e-12;

  RateGovernor from_;
  RatePieces law_{};
  std::span<const Shares> shares_;
  std::span<const RateLimit> limits_;
  Task task_{Task::kNone};
  StopTimes times_;
  std::array<double, RateCurve::kCells> until_s_{};
  CurveSteps curve_;
  std::optional<RateCurve> found_;
};

}  // namespace corbot::rate
