// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/optimum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace corbot::rate {
namespace {

constexpr int kMostSteps = 30;
constexpr double kNearest = 0.97;  // part of the way to the point at which a slack or a dual is 0

/// Hessian and gradient of one stage in (b, a, w).
struct Quadratic {
  double bb{}, ba{}, bw{}, aa{}, aw{}, ww{};
  double b{}, a{}, w{};

  /// Adds a slack with gradient g.
  void add(double slack, double dual, double tau, const std::array<double, 3>& g) noexcept {
    const double inverse = 1.0 / slack, k = dual * inverse, f = -tau * inverse;
    bb += k * g[0] * g[0];
    ba += k * g[0] * g[1];
    bw += k * g[0] * g[2];
    aa += k * g[1] * g[1];
    aw += k * g[1] * g[2];
    ww += k * g[2] * g[2];
    b += f * g[0];
    a += f * g[1];
    w += f * g[2];
  }
};

Quadratic quadratic(const Stage& s, double tau) noexcept {
  constexpr double kSmooth = 0.05;  // keeps w smooth if that costs no time
  Quadratic q;
  const double root = 1.0 / std::sqrt(s.b);
  q.b = -0.5 * s.weight * root / s.b;
  q.bb = 0.75 * s.weight * root / (s.b * s.b);
  const double h2 = s.h * s.h;
  const double smooth = 2.0 * kSmooth * s.h * h2 * h2 / (s.b * s.b);
  q.ww = smooth;
  q.w = smooth * s.w;
  q.add(s.speed_slack, s.speed_dual, tau, {-1.0 / s.most_b, 0.0, 0.0});
  for (std::size_t i = 0; i < s.count; ++i) {
    const Row& row = s.acceleration[i];
    q.add(row.slack[0], row.dual[0], tau, {-row.x[0], -row.x[1], 0.0});
    q.add(row.slack[1], row.dual[1], tau, {row.x[0], row.x[1], 0.0});
  }
  if (!s.has_jerk) return q;
  const double middle = s.middle_b(), slope = -0.5 / (middle * std::sqrt(middle));
  const std::array<double, 3> g{slope, slope * s.h, slope * 0.25 * s.h * s.h};
  for (std::size_t i = 0; i < s.count; ++i) {
    const Row& row = s.jerk[i];
    q.add(row.slack[0], row.dual[0], tau, {g[0] - row.x[0], g[1] - row.x[1], g[2] - row.x[2]});
    q.add(row.slack[1], row.dual[1], tau, {g[0] + row.x[0], g[1] + row.x[1], g[2] + row.x[2]});
  }
  return q;
}

}  // namespace

Optimum::Optimum(Grid grid) : grid_(std::move(grid)) {
  double b = 1e300;
  for (const Stage& s : grid_.stages) {
    b = std::min(b, s.most_b);
    for (std::size_t i = 0; i < s.count; ++i) {
      b = std::min(b, 1.0 / std::max(1e-300, std::abs(s.acceleration[i].x[0])));
      if (s.has_jerk) b = std::min(b, std::pow(std::max(1e-200, std::abs(s.jerk[i].x[0])), -2.0 / 3.0));
    }
  }
  for (Stage& s : grid_.stages) s.b = 0.5 * b;
  find_slacks();
  each([&](double, double, double) { rows_ += 1.0; });
  set_duals(1.0);
}

void Optimum::run(double gap) {
  double sigma = 0.3, dual_step = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    double products = 0.0;
    each([&](double slack, double dual, double) { products += slack * dual; });
    if (products < gap * time_s() && dual_step > 0.5) break;
    const double tau = sigma * products / rows_;
    solve(tau);
    // Reciprocals of the steps that make a slack or a dual 0.
    double primal = kNearest, dual = kNearest;
    each([&](double slack, double z, double change) {
      const double inverse = 1.0 / slack;
      primal = std::max(primal, -change * inverse);
      const double dz = (tau - z * change) * inverse - z;
      if (dz < 0.0) dual = std::max(dual, -dz / z);
    });
    for (const Stage& s : grid_.stages)
      primal = std::max({primal, -s.db / s.b, -s.middle_db() / s.middle_b()});
    if (!std::isfinite(primal) || !std::isfinite(dual) || !std::isfinite(grid_.stages[0].db)) break;
    dual_step = kNearest / dual;
    advance(tau, kNearest / primal, dual_step);
    const double left = 1.0 - kNearest / std::max(primal, dual);
    sigma = std::clamp(left * left, 0.3, 0.5);
  }
}

RateLaw Optimum::law() const {
  std::vector<double> steps_s;
  for (std::size_t k = 0; k + 1 < grid_.stages.size(); ++k) {
    const Stage& s = grid_.stages[k];
    double sum = 0.0;
    for (const auto& [at, weight] :  // three points of Gauss
         {std::array{0.5 - std::sqrt(0.15), 5.0 / 18.0}, std::array{0.5, 8.0 / 18.0},
          std::array{0.5 + std::sqrt(0.15), 5.0 / 18.0}}) {
      const double x = at * s.h;
      sum += weight / std::sqrt(s.b + 2.0 * s.a * x + s.w * x * x);
    }
    steps_s.push_back(sum * s.h);
  }
  return {grid_.lambda_s, steps_s};
}

void Optimum::tighten(std::span<const Shares> shares) {
  const auto beyond = [](double share, double more) {
    return share > 1.0 ? share + 0.1 * (share - 1.0) + more : 1.0;
  };
  double factor = 1.0;
  for (std::size_t k = 0; k < grid_.stages.size(); ++k) {
    Stage& s = grid_.stages[k];
    // A node is an end of two pieces.
    const Shares& after = shares[std::min(k, shares.size() - 1)];
    const Shares& before = shares[k > 0 ? k - 1 : 0];
    const double speed = beyond(std::max(before.speed, after.speed), 1e-4);
    const double acceleration = beyond(std::max(before.acceleration, after.acceleration), 2e-4);
    const double jerk = beyond(after.jerk, 3e-4);
    s.most_b /= speed * speed;
    factor = std::max(factor, std::sqrt(s.b / s.most_b));
    for (std::size_t i = 0; i < s.count; ++i) {
      Row& row = s.acceleration[i];
      for (double& x : row.x) x *= acceleration;
      factor = std::max(factor, std::sqrt(std::abs(row.x[0] * s.b + row.x[1] * s.a)));
      Row& third = s.jerk[i];
      for (double& x : third.x) x *= jerk;
      const double share = third.x[0] * s.b + third.x[1] * s.a + third.x[2] * s.w;
      if (s.has_jerk) factor = std::max(factor, std::cbrt(std::abs(share) * std::sqrt(s.middle_b())));
    }
  }
  factor *= 1.002;
  for (Stage& s : grid_.stages) {
    for (double* x : {&s.b, &s.a, &s.w}) *x /= factor * factor;
    s.db = s.da = s.dw = 0.0;
  }
  find_slacks();
  set_duals(0.03);
}

/// Calls f(slack, dual, change of the slack by the present step) for every constraint.
template <class F>
void Optimum::each(F&& f) {
  for (Stage& s : grid_.stages) {
    f(s.speed_slack, s.speed_dual, -s.db / s.most_b);
    for (std::size_t i = 0; i < s.count; ++i) {
      Row& row = s.acceleration[i];
      const double y = row.x[0] * s.db + row.x[1] * s.da;
      f(row.slack[0], row.dual[0], -y);
      f(row.slack[1], row.dual[1], y);
    }
    if (!s.has_jerk) continue;
    const double middle = s.middle_b(), root = 1.0 / std::sqrt(middle);
    const double change = -0.5 * root / middle * s.middle_db();
    for (std::size_t i = 0; i < s.count; ++i) {
      Row& row = s.jerk[i];
      const double y = row.x[0] * s.db + row.x[1] * s.da + row.x[2] * s.dw;
      f(row.slack[0], row.dual[0], change - y);
      f(row.slack[1], row.dual[1], change + y);
    }
  }
}

void Optimum::find_slacks() noexcept {
  for (Stage& s : grid_.stages) {
    s.speed_slack = 1.0 - s.b / s.most_b;
    for (std::size_t i = 0; i < s.count; ++i) {
      Row& row = s.acceleration[i];
      const double y = row.x[0] * s.b + row.x[1] * s.a;
      row.slack = {1.0 - y, 1.0 + y};
    }
    const double root = 1.0 / std::sqrt(s.middle_b());
    for (std::size_t i = 0; s.has_jerk && i < s.count; ++i) {
      Row& row = s.jerk[i];
      const double y = row.x[0] * s.b + row.x[1] * s.a + row.x[2] * s.w;
      row.slack = {root - y, root + y};
    }
  }
}

/// Makes all products of slack and dual equal; their sum is this part of the time.
void Optimum::set_duals(double part) noexcept {
  const double product = part * time_s() / rows_;
  each([&](double slack, double& dual, double) { dual = product / slack; });
}

double Optimum::time_s() const noexcept {
  double sum = 0.0;
  for (const Stage& s : grid_.stages) sum += s.weight / std::sqrt(s.b);
  return sum;
}

/// Computes the Newton step. In the first and the last cell b is constant, so these are pieces of constant
/// jerk from and to rest.
void Optimum::solve(double tau) {
  const std::size_t last = grid_.stages.size() - 1;
  std::vector<std::array<double, 3>> policy(last);   // dw = p0 db + p1 da + p2
  Quadratic v = quadratic(grid_.stages[last], tau);  // of the node after
  for (std::size_t k = last; k-- > 0;) {
    const double h = grid_.stages[k].h;
    Quadratic q = quadratic(grid_.stages[k], tau);
    const double c = h * h * v.bb + h * v.ba, d = h * h * v.ba + h * v.aa;
    q.bb += v.bb;
    q.ba += 2.0 * h * v.bb + v.ba;
    q.aa += 4.0 * h * h * v.bb + 4.0 * h * v.ba + v.aa;
    q.bw += c;
    q.aw += 2.0 * h * c + d;
    q.ww += h * h * c + h * d;
    q.b += v.b;
    q.a += 2.0 * h * v.b + v.a;
    q.w += h * h * v.b + h * v.a;
    std::array<double, 3>& p = policy[k];  // 0 in the first and the last cell
    if (k > 0 && k < last - 2) p = {-q.bw / q.ww, -q.aw / q.ww, -q.w / q.ww};
    if (k == last - 2) p = {0.0, -1.0 / h, 0.0};
    v.bb = q.bb + 2.0 * p[0] * q.bw + p[0] * p[0] * q.ww;
    v.ba = q.ba + p[0] * q.aw + p[1] * q.bw + p[0] * p[1] * q.ww;
    v.aa = q.aa + 2.0 * p[1] * q.aw + p[1] * p[1] * q.ww;
    v.b = q.b + p[0] * q.w + p[2] * (q.bw + p[0] * q.ww);
    v.a = q.a + p[1] * q.w + p[2] * (q.aw + p[1] * q.ww);
  }
  double db = -v.b / v.bb, da = 0.0;
  for (std::size_t k = 0; k <= last; ++k) {
    Stage& s = grid_.stages[k];
    s.db = db;
    s.da = da;
    s.dw = k < last ? policy[k][0] * db + policy[k][1] * da + policy[k][2] : 0.0;
    db += 2.0 * s.h * da + s.h * s.h * s.dw;
    da += s.h * s.dw;
  }
}

void Optimum::advance(double tau, double primal, double dual) {
  each([&](double& slack, double& z, double change) { z += dual * ((tau - z * change) / slack - z); });
  for (Stage& s : grid_.stages) {
    s.b += primal * s.db;
    s.a += primal * s.da;
    s.w += primal * s.dw;
  }
  find_slacks();
}

}  // namespace corbot::rate
