// SPDX-License-Identifier: Apache-2.0
#include "planner/numeric/piece_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace corbot::numeric {
namespace {

using Polynomial = KnotPiece::Polynomial;

double binomial(std::size_t n, std::size_t k) noexcept {
  double value = 1.0;
  for (std::size_t i = 1; i <= k; ++i)
    value = value * static_cast<double>(n - k + i) / static_cast<double>(i);
  return value;
}

/// The same polynomial of another variable: p(t_a + width·u).
Polynomial on_stretch(Polynomial c, double t_a, double width) noexcept {
  for (std::size_t i = 0; i < c.size(); ++i) {
    for (std::size_t k = c.size() - 1; k-- > i;) c[k] += t_a * c[k + 1];
  }
  double power = 1.0;
  for (double& coefficient : c) {
    coefficient *= power;
    power *= width;
  }
  return c;
}

Polynomial derivative(const Polynomial& c) noexcept {
  Polynomial d{};
  for (std::size_t k = 1; k < c.size(); ++k) d[k - 1] = static_cast<double>(k) * c[k];
  return d;
}

/// The greatest magnitude of the Bernstein coefficients of a polynomial of that degree on 0 … 1.
double greatest_coefficient(const Polynomial& c, std::size_t degree) noexcept {
  double greatest = 0.0;
  for (std::size_t i = 0; i <= degree; ++i) {
    double b = 0.0;
    for (std::size_t k = 0; k <= i; ++k) b += binomial(i, k) / binomial(degree, k) * c[k];
    greatest = std::max(greatest, std::abs(b));
  }
  return greatest;
}

}  // namespace

PieceBounds bound_piece(const KnotPiece& piece, double t_a, double t_b) noexcept {
  const double h = piece.length_s();
  PieceBounds bounds;
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const Polynomial rate = derivative(piece.polynomial(i));
    const Polynomial bend = derivative(rate);
    bounds.rate_q[i] = greatest_coefficient(on_stretch(rate, t_a, t_b - t_a), KnotPiece::kDegree - 1) / h;
    bounds.bend_q[i] =
        greatest_coefficient(on_stretch(bend, t_a, t_b - t_a), KnotPiece::kDegree - 2) / (h * h);
  }
  return bounds;
}

Joints rate_at(const KnotPiece& piece, double t) noexcept {
  Joints rate{};
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const Polynomial d = derivative(piece.polynomial(i));
    rate[i] = (d[0] + t * (d[1] + t * (d[2] + t * (d[3] + t * d[4])))) / piece.length_s();
  }
  return rate;
}

}  // namespace corbot::numeric
