// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/proof.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "corbot/motion/path.h"

namespace corbot::rate {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kBackward = 1e-9;  // of the greatest rate: rounding at the ends

double greatest(const std::array<double, 2>& x) noexcept { return std::max(std::abs(x[0]), std::abs(x[1])); }

/// Derivatives of one z by time: at both ends of a stretch, and bounds of their magnitudes in between.
struct Derivatives {
  std::array<double, 2> rate{}, bend{}, third{};
  double rate_bound{}, bend_bound{}, third_bound{};
  double fourth_bound{}, fifth_bound{};
};

/// A stretch of time within one piece and one cell.
class Stretch {
 public:
  Stretch(const RateState& begin, const RateState& end, double duration_s, const Cell& cell,
          double cell_begin_s)
      : ends_{begin, end}, eighth_(duration_s * duration_s / 8.0) {
    const double length = end.lambda_s - begin.lambda_s;
    lambda_eighth_ = length * length / 8.0;
    v_ = greatest({begin.v, end.v}) + eighth_ * std::abs(begin.j);
    a_ = greatest({begin.a, end.a});
    j_ = std::abs(begin.j);
    for (std::size_t e = 0; e < 2; ++e) {
      const double t = std::clamp((ends_[e].lambda_s - cell_begin_s) / cell.length_s(), 0.0, 1.0);
      for (std::size_t order = 1; order <= 5; ++order) z_[order][e] = cell.at(t, order);
    }
  }

  [[nodiscard]] Derivatives of(std::size_t i) const noexcept {
    const auto ends = [&](std::size_t order) { return greatest({z_[order][0][i], z_[order][1][i]}); };
    const double b5 = ends(5), b4 = ends(4);  // the fourth is linear
    const double b3 = ends(3) + lambda_eighth_ * b5, b2 = ends(2) + lambda_eighth_ * b4;
    const double b1 = ends(1) + lambda_eighth_ * b3;
    const double v = v_, a = a_, j = j_;
    Derivatives d;
    for (std::size_t e = 0; e < 2; ++e) {
      const RateState& at = ends_[e];
      const double z1 = z_[1][e][i], z2 = z_[2][e][i], z3 = z_[3][e][i];
      d.rate[e] = z1 * at.v;
      d.bend[e] = z2 * at.v * at.v + z1 * at.a;
      d.third[e] = z3 * at.v * at.v * at.v + 3.0 * z2 * at.v * at.a + z1 * at.j;
    }
    const double third = b3 * v * v * v + 3.0 * b2 * v * a + b1 * j;
    d.fourth_bound = b4 * v * v * v * v + 6.0 * b3 * v * v * a + b2 * (3.0 * a * a + 4.0 * v * j);
    d.fifth_bound = b5 * v * v * v * v * v + 10.0 * b4 * v * v * v * a +
                    b3 * (15.0 * v * a * a + 10.0 * v * v * j) + 10.0 * b2 * a * j;
    d.rate_bound = between(greatest(d.rate), third);
    d.bend_bound = between(greatest(d.bend), d.fourth_bound);
    d.third_bound = between(greatest(d.third), d.fifth_bound);
    return d;
  }
  /// From the greatest value at both ends, and a bound of the second derivative.
  [[nodiscard]] double between(double ends, double bend) const noexcept { return ends + eighth_ * bend; }

 private:
  std::array<RateState, 2> ends_;
  double eighth_, lambda_eighth_;
  double v_, a_, j_;                         ///< bounds of lambda's derivatives by time
  std::array<std::array<State, 2>, 6> z_{};  ///< derivatives by lambda: order, end
};

/// The tool's acceleration and jerk on an arc, by its length: (s″, w s′²) and (s‴ − w² s′³, 3 w s′ s″), w the arc's angle.
void take_arc(const Stretch& stretch, const Derivatives& s, const Limits& limits, Shares& shares) noexcept {
  const double w = limits.angle_rad;
  std::array<double, 2> acceleration{}, jerk{};
  for (std::size_t e = 0; e < 2; ++e) {
    const double p1 = s.rate[e], p2 = s.bend[e];
    acceleration[e] = std::hypot(p2, w * p1 * p1);
    jerk[e] = std::hypot(s.third[e] - w * w * p1 * p1 * p1, 3.0 * w * p1 * p2);
  }
  const double p1 = s.rate_bound, p2 = s.bend_bound, p3 = s.third_bound, w2 = w * w;
  const double fourth = s.fourth_bound + w * (4.0 * p1 * p3 + 3.0 * p2 * p2) + 6.0 * w2 * p1 * p1 * p2 +
                        w2 * w * p1 * p1 * p1 * p1;
  const double fifth = s.fifth_bound + w * (5.0 * p1 * s.fourth_bound + 10.0 * p2 * p3) +
                       w2 * (10.0 * p1 * p1 * p3 + 15.0 * p1 * p2 * p2) + 10.0 * w2 * w * p1 * p1 * p1 * p2 +
                       w2 * w2 * p1 * p1 * p1 * p1 * p1;
  shares.acceleration = std::max(shares.acceleration,
                                 stretch.between(greatest(acceleration), fourth) / limits.arc_acceleration);
  shares.jerk = std::max(shares.jerk, stretch.between(greatest(jerk), fifth) / limits.arc_jerk);
}

void take(const Stretch& stretch, const Limits& limits, Shares& shares) noexcept {
  for (std::size_t i = 0; i <= kPath; ++i) {
    if (limits.speed[i] == kInfinity && i != kPath) continue;
    const Derivatives d = stretch.of(i);
    shares.speed = std::max(shares.speed, d.rate_bound / limits.speed[i]);
    shares.acceleration = std::max(shares.acceleration, d.bend_bound / limits.acceleration[i]);
    shares.jerk = std::max(shares.jerk, d.third_bound / limits.jerk[i]);
    if (i == kPath && limits.angle_rad > 0.0) take_arc(stretch, d, limits, shares);
  }
}

/// The time between two at which lambda has the value, by halving.
double time_at(const RateLaw& law, std::size_t piece, double low_s, double high_s, double lambda_s) noexcept {
  for (int step = 0; step < 60; ++step) {
    const double middle_s = 0.5 * (low_s + high_s);
    (law.at(piece, middle_s).lambda_s < lambda_s ? low_s : high_s) = middle_s;
  }
  return high_s;
}

/// A speed of constant jerk has its least value at an end, or where the acceleration passes 0.
bool is_forward(const RateState& begin, const RateState& end, double least) noexcept {
  if (!(begin.v >= least && end.v >= least)) return false;
  return !(begin.a < 0.0 && end.a > 0.0) || begin.v - begin.a * begin.a / (2.0 * begin.j) >= least;
}

Limits common_limits(const ArmModel& model, const PlanSettings& settings, double length_m,
                     double rotation_rad) noexcept {
  const auto per = [](double limit, double amount) { return amount > 1e-30 ? limit / amount : kInfinity; };
  Limits limits;
  limits.speed = full_speed(model, settings, length_m, rotation_rad);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    if (i < model.dof) {
      limits.acceleration[i] = model.joints[i].acceleration_q_s2;
      limits.jerk[i] = model.joints[i].jerk_q_s3;
    } else {
      limits.speed[i] = limits.acceleration[i] = limits.jerk[i] = kInfinity;
    }
  }
  limits.acceleration[kPath] = per(model.path.rotation_acceleration_rad_s2, rotation_rad);
  limits.jerk[kPath] = per(model.path.rotation_jerk_rad_s3, rotation_rad);
  limits.arc_acceleration = per(model.path.acceleration_m_s2, length_m);
  limits.arc_jerk = per(model.path.jerk_m_s3, length_m);
  return limits;
}

}  // namespace

Limits limits_of(const ArmModel& model, const PlanSettings& settings, const LineMotion& line) noexcept {
  Limits limits = common_limits(model, settings, length_m(line), rotation_rad(line.tool));
  limits.acceleration[kPath] = std::min(limits.acceleration[kPath], limits.arc_acceleration);
  limits.jerk[kPath] = std::min(limits.jerk[kPath], limits.arc_jerk);
  return limits;
}

Limits limits_of(const ArmModel& model, const PlanSettings& settings, const ArcMotion& arc) noexcept {
  Limits limits = common_limits(model, settings, length_m(arc), rotation_rad(arc.tool));
  limits.angle_rad = arc.angle_rad;
  return limits;
}

std::vector<RateLimit> rate_limits(const Limits& limits) {
  std::vector<RateLimit> all;
  for (std::size_t i = 0; i <= kPath; ++i) {
    if (std::isfinite(limits.acceleration[i]) && std::isfinite(limits.jerk[i]))
      all.push_back({limits.speed[i], limits.acceleration[i], limits.jerk[i]});
  }
  if (limits.angle_rad > 0.0) all.push_back({limits.speed[kPath], limits.arc_acceleration, limits.arc_jerk});
  return all;
}

Proof prove(const RateLaw& law, std::span<const Knot> knots, const Limits& limits) {
  Proof proof;
  double fastest = 0.0;
  for (const Piece& piece : law.pieces()) fastest = std::max(fastest, piece.begin.v);
  std::size_t cell = 0;
  Cell curve(knots[0], knots[1]);
  for (std::size_t k = 0; k < law.pieces().size(); ++k) {
    const double end_s = law.end_s(k);
    double now_s = law.pieces()[k].begin_s;
    const RateState end = law.at(k, end_s);
    RateState begin = law.at(k, now_s);
    if (!is_forward(begin, end, -kBackward * fastest)) {
      proof.is_forward = false;
      return proof;
    }
    Shares shares;
    while (now_s < end_s) {
      // As far as this piece lies in this cell.
      const bool leaves = cell + 2 < knots.size() && end.lambda_s > knots[cell + 1].lambda_s;
      const double to_s = leaves ? time_at(law, k, now_s, end_s, knots[cell + 1].lambda_s) : end_s;
      const RateState to = law.at(k, to_s);
      take(Stretch(begin, to, to_s - now_s, curve, knots[cell].lambda_s), limits, shares);
      if (leaves) {
        ++cell;
        curve = Cell(knots[cell], knots[cell + 1]);
      }
      begin = to;
      now_s = to_s;
    }
    proof.pieces.push_back(shares);
    proof.factor =
        std::max({proof.factor, shares.speed, std::sqrt(shares.acceleration), std::cbrt(shares.jerk)});
  }
  return proof;
}

}  // namespace corbot::rate
