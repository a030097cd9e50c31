// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "corbot/motion/rate_pieces.h"

// The rate along a path: lambda (geometry.h) as a function of time, from rest to rest, in pieces of constant
// jerk.

namespace corbot::rate {

class RateLaw {
 public:
  /// Creates the cubic spline with two continuous derivatives that is at `lambda_s[k]` after the first k of
  /// `steps_s`, and at rest at both ends. Its second and its last but one value are free, so those of
  /// `lambda_s` are ignored. `steps_s` has at least three steps, all positive, and `lambda_s` one value more.
  /// If the values belong to a law whose jerk jumps only at them, the spline is that law.
  RateLaw(std::span<const double> lambda_s, std::span<const double> steps_s);

  /// Creates a law at rest at 0 for this time, at least 0.
  explicit RateLaw(double duration_s) : duration_s_(duration_s), length_s_(0.0), pieces_(1) {}

  [[nodiscard]] double duration_s() const noexcept { return duration_s_; }
  [[nodiscard]] double length_s() const noexcept { return length_s_; }
  [[nodiscard]] const std::vector<Piece>& pieces() const noexcept { return pieces_; }
  /// Returns the end of a piece, in time.
  [[nodiscard]] double end_s(std::size_t piece) const noexcept {
    return piece + 1 < pieces_.size() ? pieces_[piece + 1].begin_s : duration_s_;
  }
  /// Returns the pieces of this law, which must outlive them.
  [[nodiscard]] RatePieces view() const noexcept { return {pieces_, duration_s_, length_s_}; }
  [[nodiscard]] RateState at(std::size_t piece, double t_s) const noexcept { return view().at(piece, t_s); }
  [[nodiscard]] RateState at(double t_s) const noexcept { return view().at(t_s); }
  /// Multiplies all times by `factor`. The speed, acceleration and jerk of values that follow lambda fall by
  /// its first, second and third power.
  void stretch(double factor) noexcept;
  /// Stretches a shorter law to exactly this time.
  void last_at_least(double t_s) noexcept;

 private:
  double duration_s_{}, length_s_;
  std::vector<Piece> pieces_;
};

}  // namespace corbot::rate
