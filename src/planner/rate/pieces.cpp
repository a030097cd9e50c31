// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/pieces.h"

#include <cstddef>

namespace corbot::rate {
namespace {

/// One row of the equations for the second derivatives m. It reads below · m[k − 1] + middle · m[k] + above ·
/// m[k + 1] = right.
struct SplineRow {
  double below{}, middle{}, above{}, right{};
};

/// Returns row k: the first derivative does not jump at node k. The spline is at rest at both ends, so
/// lambda[1] = m[1] h²/6 with the first step h. The same holds at the end. Both terms move to the left side.
SplineRow spline_row(std::span<const double> lambda_s, std::span<const double> steps_s, std::size_t k) {
  const std::size_t last = steps_s.size();
  const double before = steps_s[k - 1], after = steps_s[k];
  SplineRow row{before / 6.0, (before + after) / 3.0, after / 6.0, 0.0};
  const double factors[] = {1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after};
  double* const columns[] = {&row.below, &row.middle, &row.above};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t node = k - 1 + i;
    if (node == 1) {
      *columns[i] -= factors[i] * steps_s.front() * steps_s.front() / 6.0;
      row.right += factors[i] * lambda_s.front();
    } else if (node == last - 1) {
      *columns[i] -= factors[i] * steps_s.back() * steps_s.back() / 6.0;
      row.right += factors[i] * lambda_s.back();
    } else {
      row.right += factors[i] * lambda_s[node];
    }
  }
  return row;
}

}  // namespace

RateLaw::RateLaw(std::span<const double> lambda_s, std::span<const double> steps_s)
    : length_s_(lambda_s.back()) {
  const std::size_t count = steps_s.size();
  std::vector<SplineRow> rows(count);
  for (std::size_t k = 1; k < count; ++k) rows[k] = spline_row(lambda_s, steps_s, k);
  for (std::size_t k = 2; k < count; ++k) {
    const double f = rows[k].below / rows[k - 1].middle;
    rows[k].middle -= f * rows[k - 1].above;
    rows[k].right -= f * rows[k - 1].right;
  }
  std::vector<double> m(count + 1, 0.0);
  for (std::size_t k = count - 1; k > 0; --k)
    m[k] = (rows[k].right - (k + 1 < count ? rows[k].above * m[k + 1] : 0.0)) / rows[k].middle;
  RateState now{lambda_s.front(), 0.0, 0.0, 0.0};
  pieces_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    now.a = m[k];
    now.j = (m[k + 1] - m[k]) / steps_s[k];
    pieces_.push_back({duration_s_, now});
    now = advanced(now, steps_s[k]);
    duration_s_ += steps_s[k];
  }
}

void RateLaw::stretch(double factor) noexcept {
  duration_s_ *= factor;
  for (Piece& p : pieces_) {
    p.begin_s *= factor;
    p.begin.v /= factor;
    p.begin.a /= factor * factor;
    p.begin.j /= factor * factor * factor;
  }
}

void RateLaw::last_at_least(double t_s) noexcept {
  if (!(t_s > duration_s_)) return;
  stretch(t_s / duration_s_);
  duration_s_ = t_s;
}

}  // namespace corbot::rate
