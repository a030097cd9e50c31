// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/ranges.h"

#include <algorithm>
#include <vector>

#include "planner/plan/refusal.h"

namespace corbot::rate {
namespace {

constexpr double kNarrowest = 1e-9;  // of a cell: a narrower stretch hides less than the tolerance

/// A polynomial of the fifth degree on a stretch of a cell, as Bernstein coefficients. It lies between the
/// least and the greatest coefficient (Farouki, Computer Aided Geometric Design 29, 2012). Its values at the
/// ends are the first and the last coefficient.
struct RangeStretch {
  std::array<double, 6> bernstein{};
  double begin{}, length{};  ///< parts of the cell
};

/// `c`: Σ c[k]·t^k on the whole cell.
RangeStretch whole_cell(const std::array<double, 6>& c) noexcept {
  constexpr double kBinomial[6][6] = {{1},          {1, 1},          {1, 2, 1},
                                      {1, 3, 3, 1}, {1, 4, 6, 4, 1}, {1, 5, 10, 10, 5, 1}};
  RangeStretch whole{{}, 0.0, 1.0};
  for (std::size_t i = 0; i < c.size(); ++i) {
    for (std::size_t k = 0; k <= i; ++k) whole.bernstein[i] += kBinomial[i][k] / kBinomial[5][k] * c[k];
  }
  return whole;
}

/// Returns the first half and leaves the second in `whole`.
RangeStretch first_half(RangeStretch& whole) noexcept {
  whole.length *= 0.5;
  RangeStretch first = whole;
  std::array<double, 6>& b = whole.bernstein;
  for (std::size_t level = 0; level < b.size(); ++level) {
    first.bernstein[level] = b[0];
    for (std::size_t i = 0; i + level + 1 < b.size(); ++i) b[i] = 0.5 * (b[i] + b[i + 1]);
  }
  whole.begin += whole.length;
  return first;
}

/// Returns a place where the joint is outside its range, as a part of the cell.
std::optional<double> outside_at(const std::array<double, 6>& c, const JointLimits& limits) {
  std::vector<RangeStretch> open{whole_cell(c)};
  while (!open.empty()) {
    RangeStretch now = open.back();
    open.pop_back();
    if (!in_range(limits, now.bernstein.front())) return now.begin;
    if (!in_range(limits, now.bernstein.back())) return now.begin + now.length;
    const auto [least, greatest] = std::minmax_element(now.bernstein.begin(), now.bernstein.end());
    if ((in_range(limits, *least) && in_range(limits, *greatest)) || now.length < kNarrowest) continue;
    const RangeStretch first = first_half(now);
    open.push_back(now);
    open.push_back(first);
  }
  return std::nullopt;
}

}  // namespace

std::optional<RangeBreach> find_breach(std::span<const Knot> knots, std::size_t dof,
                                       const std::array<JointLimits, kMaxJoints>& limits) {
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const Cell cell(knots[k], knots[k + 1]);
    for (std::size_t i = 0; i < dof; ++i) {
      const std::optional<double> t = outside_at(cell.polynomial(i), limits[i]);
      if (t) return RangeBreach{i, cell.at(*t)[i], knots[k].lambda_s + *t * cell.length_s()};
    }
  }
  return std::nullopt;
}

}  // namespace corbot::rate
