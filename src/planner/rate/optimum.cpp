// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/optimum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace corbot::rate {
namespace {

constexpr std::size_t kDirections = 6;  // of an arc's vectors, each two-sided: a polygon of 12 sides
constexpr std::size_t kMostRows = kMaxJoints + 1 + kDirections;
constexpr int kMostSteps = 30;
constexpr double kGap = 2e-3;  // of the time, by which the answer may be off

/// Derivatives of z by mu.
struct Curvature {
  State first{}, second{}, third{};
};

class Curve {
 public:
  Curve(std::span<const Knot> knots, const Ramp& ramp) : knots_(knots), ramp_(ramp) {}
  [[nodiscard]] Curvature at(double mu) const noexcept {
    const std::array<double, 4> g = ramp_.at(mu);
    const auto inner = knots_.subspan(1, knots_.size() - 2);
    const auto next = std::upper_bound(inner.begin(), inner.end(), g[0],
                                       [](double x, const Knot& knot) { return x < knot.lambda_s; });
    const auto i = static_cast<std::size_t>(next - inner.begin());
    const Cell cell(knots_[i], knots_[i + 1]);
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
};

/// |b·x0 + a·x1 + w·x2| <= 1 at a node, <= b_m^(−1/2) in a middle, with slacks and duals of both sides.
struct Row {
  std::array<double, 3> x{};
  std::array<double, 2> slack{}, dual{};
};

/// A node and the cell after it.
struct Stage {
  double h{}, weight{};  ///< of the cell; of b^(−1/2) in the time
  double most_b{}, speed_slack{}, speed_dual{};
  std::array<Row, kMostRows> acceleration{}, jerk{};
  std::size_t count{};  ///< of each kind
  bool has_jerk{};
  double b{}, a{}, w{};
  double db{}, da{}, dw{};

  [[nodiscard]] double middle_b() const noexcept { return b + h * a + 0.25 * h * h * w; }
  [[nodiscard]] double middle_db() const noexcept { return db + h * da + 0.25 * h * h * dw; }
};

/// The greatest constant b that keeps the limits at a place.
double cap(const Curvature& c, const Limits& limits) noexcept {
  double b = 1e300;
  const auto take = [&](double most, double is, double power) {
    if (is > 1e-30 && std::isfinite(most)) b = std::min(b, std::pow(most / is, power));
  };
  for (std::size_t i = 0; i <= kPath; ++i) {
    take(limits.speed[i], std::abs(c.first[i]), 2.0);
    take(limits.acceleration[i], std::abs(c.second[i]), 1.0);
    take(limits.jerk[i], std::abs(c.third[i]), 2.0 / 3.0);
  }
  return b;
}

/// Nodes where something happens: by parts evenly in mu, in the knots, in both ramps, and in the time that the caps take.
std::vector<double> nodes(const Curve& curve, std::span<const Knot> knots, const Ramp& ramp,
                          const Limits& limits, std::size_t count) {
  const double m = ramp.length_mu(), r = ramp.ramp_mu();
  std::vector<std::array<double, 2>> points;  // mu, and the number of the knot
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double from = ramp.mu_at(knots[k].lambda_s), to = ramp.mu_at(knots[k + 1].lambda_s);
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

class Optimum {
 public:
  Optimum(const Curve& curve, const std::vector<double>& mu, const Limits& limits) : stages_(mu.size()) {
    for (std::size_t k = 0; k < mu.size(); ++k) {
      Stage& s = stages_[k];
      s.has_jerk = k + 1 < mu.size();
      s.h = s.has_jerk ? mu[k + 1] - mu[k] : 0.0;
      s.weight = 0.5 * (s.h + (k > 0 ? mu[k] - mu[k - 1] : 0.0));
      const Curvature at = curve.at(mu[k]);
      double least = 0.0;
      for (std::size_t i = 0; i <= kPath; ++i)
        least = std::max(least, std::pow(at.first[i] / limits.speed[i], 2));
      s.most_b = 1.0 / std::max(least, 1e-30);
      s.count = add_rows(at, limits, s.acceleration, false, s.h);
      if (s.has_jerk) add_rows(curve.at(mu[k] + 0.5 * s.h), limits, s.jerk, true, s.h);
    }
  }

  void run() {
    start();
    double sigma = 0.3;
    for (int step = 0; step < kMostSteps; ++step) {
      double products = 0.0, rows = 0.0;
      each([&](double slack, double dual, double) {
        products += slack * dual;
        rows += 1.0;
      });
      if (products < kGap * time_s() && least_dual_step_ > 0.5) break;
      const double tau = sigma * products / rows;
      solve(tau);
      double primal = 1.0 / 0.97, dual = 1.0 / 0.97;
      each([&](double slack, double z, double change) {
        if (change < 0.0) primal = std::min(primal, -slack / change);
        const double dz = (tau - z * change) / slack - z;
        if (dz < 0.0) dual = std::min(dual, -z / dz);
      });
      for (const Stage& s : stages_) {
        if (s.db < 0.0) primal = std::min(primal, -s.b / s.db);
        if (s.middle_db() < 0.0) primal = std::min(primal, -s.middle_b() / s.middle_db());
      }
      if (!std::isfinite(primal) || !std::isfinite(dual) || !std::isfinite(stages_[0].db)) break;
      advance(tau, 0.97 * primal, 0.97 * dual);
      least_dual_step_ = 0.97 * dual;
      sigma = std::clamp(std::pow(1.0 - 0.97 * std::min(primal, dual), 2), 0.3, 0.5);
    }
  }

  /// Time of each cell, by three points of Gauss.
  [[nodiscard]] std::vector<double> steps_s() const {
    std::vector<double> steps;
    for (std::size_t k = 0; k + 1 < stages_.size(); ++k) {
      const Stage& s = stages_[k];
      double sum = 0.0;
      for (const auto& [at, weight] :
           {std::array{0.5 - std::sqrt(0.15), 5.0 / 18.0}, std::array{0.5, 8.0 / 18.0},
            std::array{0.5 + std::sqrt(0.15), 5.0 / 18.0}}) {
        const double x = at * s.h;
        sum += weight / std::sqrt(s.b + 2.0 * s.a * x + s.w * x * x);
      }
      steps.push_back(sum * s.h);
    }
    return steps;
  }

 private:
  static std::size_t add_rows(const Curvature& c, const Limits& limits, std::array<Row, kMostRows>& rows,
                              bool is_jerk, double h) {
    std::size_t count = 0;
    const auto put = [&](double b, double a, double w, double limit) {
      if (!std::isfinite(limit)) return;
      // A middle's b, a and w in those of the node before it.
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

  /// f(slack, dual, change of the slack by the present step) for every constraint.
  template <class F>
  void each(F&& f) {
    for (Stage& s : stages_) {
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

  void find_slacks() noexcept {
    for (Stage& s : stages_) {
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

  /// Half of the greatest constant b.
  void start() {
    double b = 1e300;
    for (const Stage& s : stages_) {
      b = std::min(b, s.most_b);
      for (std::size_t i = 0; i < s.count; ++i) {
        b = std::min(b, 1.0 / std::max(1e-300, std::abs(s.acceleration[i].x[0])));
        if (s.has_jerk) b = std::min(b, std::pow(std::max(1e-200, std::abs(s.jerk[i].x[0])), -2.0 / 3.0));
      }
    }
    double rows = 0.0;
    for (Stage& s : stages_) s.b = 0.5 * b;
    find_slacks();
    each([&](double, double, double) { rows += 1.0; });
    const double product = time_s() / rows;
    each([&](double& slack, double& dual, double) { dual = product / slack; });
  }

  [[nodiscard]] double time_s() const noexcept {
    double sum = 0.0;
    for (const Stage& s : stages_) sum += s.weight / std::sqrt(s.b);
    return sum;
  }

  /// Hessian and gradient of one stage in (b, a, w).
  struct Quadratic {
    double bb{}, ba{}, bw{}, aa{}, aw{}, ww{};
    double b{}, a{}, w{};

    /// A slack whose gradient is g.
    void add(double slack, double dual, double tau, const std::array<double, 3>& g) noexcept {
      const double k = dual / slack, f = -tau / slack;
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

  [[nodiscard]] static Quadratic quadratic(const Stage& s, double tau) noexcept {
    constexpr double kSmooth = 0.05;  // keeps w smooth where it costs nothing
    Quadratic q;
    const double root = 1.0 / std::sqrt(s.b);
    q.b = -0.5 * s.weight * root / s.b;
    q.bb = 0.75 * s.weight * root / (s.b * s.b);
    const double smooth = 2.0 * kSmooth * std::pow(s.h, 5) / (s.b * s.b);
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

  /// The Newton step. In the first and in the last cell b is constant, so that they are pieces of constant jerk from and to rest.
  void solve(double tau) {
    const std::size_t last = stages_.size() - 1;
    std::vector<std::array<double, 3>> policy(last);  // dw = p0 db + p1 da + p2
    Quadratic v = quadratic(stages_[last], tau);      // of the node after
    for (std::size_t k = last; k-- > 0;) {
      const double h = stages_[k].h;
      Quadratic q = quadratic(stages_[k], tau);
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
      std::array<double, 3>& p = policy[k];  // 0 in the first and in the last cell
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
      Stage& s = stages_[k];
      s.db = db;
      s.da = da;
      s.dw = k < last ? policy[k][0] * db + policy[k][1] * da + policy[k][2] : 0.0;
      db += 2.0 * s.h * da + s.h * s.h * s.dw;
      da += s.h * s.dw;
    }
  }

  void advance(double tau, double primal, double dual) {
    each([&](double& slack, double& z, double change) { z += dual * ((tau - z * change) / slack - z); });
    for (Stage& s : stages_) {
      s.b += primal * s.db;
      s.a += primal * s.da;
      s.w += primal * s.dw;
    }
    find_slacks();
  }

  std::vector<Stage> stages_;
  double least_dual_step_{};
};

/// The longest time that any limit takes to full speed.
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

/// The slope is y² (6 − 8 y + 3 y²) with y = mu/r up to r, then 1; the second half mirrors the first.
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

RateLaw optimum(std::span<const Knot> knots, const Limits& limits) {
  const Ramp ramp(knots.back().lambda_s, 1.5 * longest_ramp_s(limits));
  const Curve curve(knots, ramp);
  const std::size_t count = std::clamp<std::size_t>(44 + knots.size(), 64, 112);
  const std::vector<double> mu = nodes(curve, knots, ramp, limits, count);
  Optimum optimum(curve, mu, limits);
  optimum.run();
  std::vector<double> lambda_s;
  for (const double m : mu) lambda_s.push_back(ramp.at(m)[0]);
  lambda_s.back() = knots.back().lambda_s;
  return {lambda_s, optimum.steps_s()};
}

}  // namespace corbot::rate
