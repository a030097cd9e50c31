// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace corbot::rate {
namespace {

/// Derivatives of z by mu.
struct Curvature {
  State first{}, second{}, third{};
};

class Curve {
 public:
  Curve(std::span<const Knot> knots, const Ramp& ramp) : knots_(knots), ramp_(ramp) {
    cells_.reserve(knots.size() - 1);
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) cells_.emplace_back(knots[k], knots[k + 1]);
  }
  [[nodiscard]] Curvature at(double mu) const noexcept {
    const std::array<double, 4> g = ramp_.at(mu);
    const std::size_t i = cell_at(knots_, g[0]);
    const Cell& cell = cells_[i];
    const double t = std::clamp((g[0] - knots_[i].lambda_s) / cell.length_s(), 0.0, 1.0);
    const State z1 = cell.at(t, 1), z2 = cell.at(t, 2), z3 = cell.at(t, 3);
    Curvature c;
    for (std::size_t k = 0; k < z1.size(); ++k) {
      c.first[k] = z1[k] * g[1];
      c.second[k] = z2[k] * g[1] * g[1] + z1[k] * g[2];
      c.third[k] = z3[k] * g[1] * g[1] * g[1] + 3.0 * z2[k] * g[1] * g[2] + z1[k] * g[3];
    }
    return c;
  }

 private:
  std::span<const Knot> knots_;
  const Ramp& ramp_;
  std::vector<Cell> cells_;
};

/// Returns the greatest constant b that keeps the limits at a point.
double cap(const Curvature& c, const Limits& limits) noexcept {
  double b = 1e300;
  const auto share = [](double is, double most) { return std::max(std::abs(is) / most, 1e-150); };
  for (std::size_t i = 0; i <= kPath; ++i) {
    const double speed = share(c.first[i], limits.speed[i]);
    const double jerk = std::cbrt(share(c.third[i], limits.jerk[i]));
    b = std::min(
        {b, 1.0 / (speed * speed), 1.0 / share(c.second[i], limits.acceleration[i]), 1.0 / (jerk * jerk)});
  }
  return b;
}

/// Returns the grid's nodes. They are spaced evenly by parts in mu, in the knots, in both ramps, and in the
/// time at the caps.
std::vector<double> nodes(const Curve& curve, std::span<const Knot> knots, const Ramp& ramp,
                          const Limits& limits, std::size_t count) {
  const double m = ramp.length_mu(), r = ramp.ramp_mu();
  std::vector<std::array<double, 2>> points;  // mu, and the number of the knot
  double to = 0.0;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double from = to;
    to = ramp.mu_at(knots[k + 1].lambda_s);
    const int parts = std::max(4, static_cast<int>(64.0 * (to - from) / m));
    for (int i = 0; i < parts; ++i) {
      const double t = static_cast<double>(i) / parts;
      points.push_back({from + t * (to - from), static_cast<double>(k) + t});
    }
  }
  points.push_back({m, static_cast<double>(knots.size() - 1)});
  std::vector<double> time(points.size(), 0.0), share(points.size());
  double before = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double slowness = 1.0 / std::sqrt(cap(curve.at(points[i][0]), limits));
    if (i > 0) time[i] = time[i - 1] + 0.5 * (slowness + before) * (points[i][0] - points[i - 1][0]);
    before = slowness;
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double mu = points[i][0];
    const double ramps = (std::min(mu, r) + std::max(0.0, mu - (m - r))) / (2.0 * r);
    share[i] = 0.15 * mu / m + 0.25 * points[i][1] / static_cast<double>(knots.size() - 1) + 0.35 * ramps +
               0.25 * time[i] / time.back();
  }
  std::vector<double> mu(count + 1, 0.0);
  std::size_t at = 0;
  for (std::size_t k = 1; k < count; ++k) {
    const double wanted = static_cast<double>(k) / static_cast<double>(count);
    while (at + 2 < share.size() && share[at + 1] < wanted) ++at;
    const double t = (wanted - share[at]) / (share[at + 1] - share[at]);
    mu[k] = points[at][0] + t * (points[at + 1][0] - points[at][0]);
  }
  mu[count] = m;
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<double> y = mu;
    for (std::size_t k = 1; k < count; ++k) mu[k] = 0.25 * y[k - 1] + 0.5 * y[k] + 0.25 * y[k + 1];
  }
  return mu;
}
/// Adds rows for the acceleration at a node, or for the jerk in the middle of the next cell, of length `h`.
/// Returns the number of rows.
std::size_t add_rows(const Curvature& c, const Limits& limits, std::array<Row, kMostRows>& rows, bool is_jerk,
                     double h) {
  std::size_t count = 0;
  const auto put = [&](double b, double a, double w, double limit) {
    if (!std::isfinite(limit)) return;
    // b, a and w in a middle, expressed by those of the node before it
    if (is_jerk)
      rows[count].x = {b / limit, (a + b * h) / limit, (w + a * h / 2.0 + b * h * h / 4.0) / limit};
    if (!is_jerk) rows[count].x = {b / limit, a / limit, 0.0};
    ++count;
  };
  for (std::size_t i = 0; i <= kPath; ++i) {
    if (is_jerk) put(c.third[i], 3.0 * c.second[i], c.first[i], limits.jerk[i]);
    if (!is_jerk) put(c.second[i], c.first[i], 0.0, limits.acceleration[i]);
  }
  const double w = limits.angle_rad, s1 = c.first[kPath], s2 = c.second[kPath], s3 = c.third[kPath];
  for (std::size_t d = 0; w > 0.0 && d < kDirections; ++d) {
    const double angle = std::numbers::pi * static_cast<double>(d) / kDirections;
    const double x = std::cos(angle), y = std::sin(angle);
    const double inside = std::cos(std::numbers::pi / (2.0 * kDirections));
    if (is_jerk) {
      put(x * (s3 - w * w * s1 * s1 * s1) + y * 3.0 * w * s1 * s2, 3.0 * x * s2 + 3.0 * y * w * s1 * s1,
          x * s1, limits.arc_jerk * inside);
    } else {
      put(x * s2 + y * w * s1 * s1, x * s1, 0.0, limits.arc_acceleration * inside);
    }
  }
  return count;
}

/// Returns the longest time that any limit needs to reach full speed.
double longest_ramp_s(const Limits& limits) noexcept {
  double longest = 0.0;
  for (std::size_t i = 0; i <= kPath; ++i) {
    const double v = limits.speed[i];
    double a = limits.acceleration[i], j = limits.jerk[i];
    if (i == kPath) {
      a = std::min(a, limits.arc_acceleration);
      j = std::min(j, limits.arc_jerk);
    }
    if (!std::isfinite(v) || !std::isfinite(a) || !std::isfinite(j)) continue;
    longest = std::max(longest, v * j > a * a ? v / a + a / j : 2.0 * std::sqrt(v / j));
  }
  return longest;
}
}  // namespace

Ramp::Ramp(double length_s, double ramp_s) noexcept
    : length_s_(length_s), length_mu_(length_s + 0.8 * ramp_s), ramp_mu_(ramp_s) {
  if (ramp_mu_ <= 0.5 * length_mu_) return;
  length_mu_ = length_s / 0.6;
  ramp_mu_ = 0.5 * length_mu_;
}

/// The slope is y² (6 − 8 y + 3 y²) with y = mu/r up to r, then 1. The second half mirrors the first.
std::array<double, 4> Ramp::at(double mu) const noexcept {
  if (mu > 0.5 * length_mu_) {
    const std::array<double, 4> g = at(length_mu_ - mu);
    return {length_s_ - g[0], g[1], -g[2], g[3]};
  }
  const double r = ramp_mu_, y = mu / r, x = 1.0 - y;
  if (y >= 1.0) return {mu - 0.4 * r, 1.0, 0.0, 0.0};
  return {r * y * y * y * (2.0 - 2.0 * y + 0.6 * y * y), y * y * (6.0 - 8.0 * y + 3.0 * y * y),
          12.0 * y * x * x / r, 12.0 * x * (1.0 - 3.0 * y) / (r * r)};
}

double Ramp::mu_at(double lambda_s) const noexcept {
  if (lambda_s >= 0.6 * ramp_mu_ && lambda_s <= length_s_ - 0.6 * ramp_mu_) return lambda_s + 0.4 * ramp_mu_;
  double low = 0.0, high = length_mu_;
  for (int step = 0; step < 42; ++step) {
    const double middle = 0.5 * (low + high);
    (at(middle)[0] < lambda_s ? low : high) = middle;
  }
  return lambda_s <= 0.0 ? 0.0 : high;
}

Grid::Grid(std::span<const Knot> knots, const Limits& limits) {
  const Ramp ramp(knots.back().lambda_s, 1.5 * longest_ramp_s(limits));
  const Curve curve(knots, ramp);
  const std::size_t count = std::clamp<std::size_t>(44 + knots.size(), 64, 112);
  const std::vector<double> mu = nodes(curve, knots, ramp, limits, count);
  stages.resize(mu.size());
  for (std::size_t k = 0; k < mu.size(); ++k) {
    Stage& s = stages[k];
    s.has_jerk = k < count;
    s.h = s.has_jerk ? mu[k + 1] - mu[k] : 0.0;
    s.weight = 0.5 * (s.h + (k > 0 ? mu[k] - mu[k - 1] : 0.0));
    const Curvature at = curve.at(mu[k]);
    double least = 0.0;
    for (std::size_t i = 0; i <= kPath; ++i) least = std::max(least, std::abs(at.first[i]) / limits.speed[i]);
    s.most_b = 1.0 / std::max(least * least, 1e-30);
    s.count = add_rows(at, limits, s.acceleration, false, s.h);
    if (s.has_jerk) add_rows(curve.at(mu[k] + 0.5 * s.h), limits, s.jerk, true, s.h);
    lambda_s.push_back(ramp.at(mu[k])[0]);
  }
  lambda_s.back() = knots.back().lambda_s;
}
}  // namespace corbot::rate
