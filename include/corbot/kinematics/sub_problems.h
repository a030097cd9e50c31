// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "corbot/kinematics/arc_tangent.h"
#include "corbot/kinematics/pose.h"
#include "corbot/kinematics/zyz.h"

// The three sub-problems that compose every closed form, with their degenerate cases. Angles use atan2 only,
// and differences of squares are factored: nothing loses digits at a border. Real-time safe. Sources: Paden,
// Kahan (sub-problems); Elias and Wen, IK-Geo, 2025; the half-angle form of KINEMATICS' eq. (8).

namespace corbot {

/// A length that misses its border by no more counts as on it: rounding must not make a stretched arm an
/// error.
inline constexpr double kBorder_m = 1e-12;
/// Nearer to an axis than this, the angle about it is free.
inline constexpr double kOnAxis_m = 1e-13;
/// The rounding of an arm's positions.
inline constexpr double kRounding_m = 1e-15;
/// Farther from an axis, the angle about it has twelve digits from the position alone.
inline constexpr double kNearAxis_m = 1e-3;

enum class Reach { kOk, kTooFar, kTooClose };

/// The angle about an axis, for an arm whose plane passes the axis at a lateral offset.
struct Turn {
  Reach reach{Reach::kOk};
  bool free{};         ///< the point is on the axis: any angle does; angle_rad is 0
  double angle_rad{};  ///< in [−π, π], except for a heading that was taken
  double cosine{1.0}, sine{};
  double radius_m{};    ///< s: distance of the point ahead of the axis within the plane; negative: behind it
  double distance_m{};  ///< ρ; for kTooClose, it is smaller than |b|
  /// The part of radius_m that rounding leaves open: much more than of the point if ρ is next to |b|.
  double slack_m{};
};

/// Cosine and sine of half an angle in [−π, π], from those of the angle. A whole turn more changes both
/// signs.
struct HalfAngle {
  double cosine, sine;
};
[[nodiscard]] inline HalfAngle half_angle(double cosine, double sine) noexcept {
  if (cosine >= 0.0) {
    const double c = std::sqrt(0.5 * (1.0 + cosine));
    return {c, 0.5 * sine / c};
  }
  const double s = std::copysign(std::sqrt(0.5 * (1.0 - cosine)), sine);
  return {0.5 * sine / s, s};
}

/// Returns the u that puts (u, v) at the limit of a distance, if it is within the slack; else u. If two
/// borders meet, the second must not refuse the part of u that the first leaves open.
[[nodiscard]] inline double nudged(double u, double v, double limit_m, double slack_m) noexcept {
  const double there = std::copysign(std::sqrt(std::fmax(0.0, (limit_m - v) * (limit_m + v))), u);
  return std::abs(there - u) <= slack_m ? there : u;
}

/// Returns θ such that (x, y) = Rz(θ)·(s, b). s = ±√((ρ − |b|)(ρ + |b|)), θ = atan2(y, x) − atan2(b, s), both
/// in one atan2. `behind` takes the negative root. ρ < |b|: too close. ρ = |b|: both roots are the same. ρ =
/// b = 0: free. `x_slack_m` is the open part of x.
[[nodiscard]] inline Turn turn(double x, double y, double b, bool behind, double x_slack_m = 0.0) noexcept {
  Turn t;
  const double offset = std::abs(b);
  double rho = root_sum(x, y);
  if (x_slack_m > 0.0 && rho < offset) {
    x = nudged(x, y, offset, x_slack_m);
    rho = root_sum(x, y);
  }
  t.distance_m = rho;
  if (rho < offset - kBorder_m) {
    t.reach = Reach::kTooClose;
    return t;
  }
  if (rho <= kOnAxis_m) {
    t.free = true;
    return t;
  }
  const double facing = behind ? -1.0 : 1.0;
  if (b == 0.0) {
    t.radius_m = facing * rho;
    t.angle_rad = arc_tangent(facing * y, facing * x);
    t.cosine = facing * x / rho;
    t.sine = facing * y / rho;
    return t;
  }
  t.radius_m = facing * std::sqrt(std::fmax(0.0, (rho - offset) * (rho + offset)));
  t.slack_m = kRounding_m * rho / std::fmax(std::abs(t.radius_m), std::sqrt(2.0 * rho * kRounding_m));
  // By the difference's formulas; if the border was clamped, ρ² and s² + b² differ by the clamp.
  const double k = 1.0 / (rho * root_sum(t.radius_m, b));
  t.cosine = k * (x * t.radius_m + y * b);
  t.sine = k * (y * t.radius_m - x * b);
  t.angle_rad = arc_tangent(t.sine, t.cosine);
  return t;
}

/// Takes a heading given by an orientation, and returns whether it did. A point next to the axis, or at the
/// border ρ = |b|, hardly determines the angle (1e-16 m at 1e-8 m is 1e-8 rad). A heading is better if it
/// brings the point within kOnAxis_m of its lateral offset on the wanted side.
inline bool take_heading(Turn& t, double x, double y, double b, bool behind, double heading_rad) noexcept {
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  const double ahead = c * x + s * y;
  if (std::abs(c * y - s * x - b) > kOnAxis_m || (behind ? ahead > 0.0 : ahead < 0.0)) return false;
  t.angle_rad = heading_rad;
  t.cosine = c;
  t.sine = s;
  t.radius_m = ahead;
  t.slack_m = 0.0;
  return true;
}

/// Two links in a plane.
struct TwoLinks {
  Reach reach{Reach::kOk};
  bool free{};                 ///< folded onto its own base (d = 0, equal links): first_rad is free, and 0
  double first_rad{};          ///< A: angle of the first link, counter-clockwise from u
  double second_rad{};         ///< γ in [−π, π]: angle of the second link to the first; 0 is stretched
  double cosine{1.0}, sine{};  ///< of A + γ; if `free`, of γ
  double distance_m{};         ///< d: from the first link's base to the point

  /// Sets A if it is free.
  void set_first(double angle_rad) noexcept {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    const double second_cosine = cosine, second_sine = sine;
    first_rad = angle_rad;
    cosine = c * second_cosine - s * second_sine;
    sine = s * second_cosine + c * second_sine;
  }
};

/// The common part of both bends of two links: the triangle of L1, L2 and d.
struct Triangle {
  Reach reach{Reach::kOk};
  double u{}, v{};          ///< the point, nudged to a border if the border is open
  double distance_m{};      ///< d
  double ahead{};           ///< 2 L1 (L1 + L2 cos γ)
  double side{};            ///< 2 L1 L2 sin γ, γ ≥ 0
  double bent_rad{};        ///< γ
  double cosine{}, sine{};  ///< of γ
};

/// Solves the triangle: tan(γ/2) = √((L1+L2−d)(L1+L2+d)) / √((d−|L1−L2|)(d+|L1−L2|)); L1, L2 > 0.
/// `u_slack_m` is the open part of u.
[[nodiscard]] inline Triangle triangle(double u, double v, double l1, double l2,
                                       double u_slack_m = 0.0) noexcept {
  Triangle t;
  const double sum = l1 + l2;
  const double difference = std::abs(l1 - l2);
  double d = root_sum(u, v);
  if (u_slack_m > 0.0 && (d > sum || d < difference)) {
    u = nudged(u, v, d > sum ? sum : difference, u_slack_m);
    d = root_sum(u, v);
  }
  t.u = u;
  t.v = v;
  t.distance_m = d;
  if (d > sum + kBorder_m) {
    t.reach = Reach::kTooFar;
    return t;
  }
  if (d < difference - kBorder_m) {
    t.reach = Reach::kTooClose;
    return t;
  }
  const double near = std::fmax(0.0, (d - difference) * (d + difference));
  const double far = std::fmax(0.0, (sum - d) * (sum + d));
  const double k = 1.0 / (near + far);
  t.side = std::sqrt(near * far);
  t.cosine = k * (near - far);
  t.sine = k * 2.0 * t.side;
  t.bent_rad = arc_tangent(2.0 * t.side, near - far);
  t.ahead = 2.0 * l1 * (l1 - l2) + near;  // avoids the cancellation near the folded arm
  return t;
}

/// Computes A = atan2(v, u) − atan2(L2 sin γ, L1 + L2 cos γ), in one, with γ ≥ 0 or, `clockwise`, γ ≤ 0.
[[nodiscard]] inline TwoLinks bend(const Triangle& triangle, bool clockwise) noexcept {
  TwoLinks t;
  t.reach = triangle.reach;
  t.distance_m = triangle.distance_m;
  if (t.reach != Reach::kOk) return t;
  const double sign = clockwise ? -1.0 : 1.0;
  const double side = sign * triangle.side, sine = sign * triangle.sine;
  t.second_rad = sign * triangle.bent_rad;
  if (triangle.distance_m <= kOnAxis_m) {
    t.free = true;
    t.cosine = triangle.cosine;
    t.sine = sine;
    return t;
  }
  const double upward = triangle.v * triangle.ahead - triangle.u * side;
  const double onward = triangle.u * triangle.ahead + triangle.v * side;
  const double k = 1.0 / root_sum(upward, onward);
  t.first_rad = arc_tangent(upward, onward);
  t.cosine = k * (onward * triangle.cosine - upward * sine);
  t.sine = k * (upward * triangle.cosine + onward * sine);
  return t;
}

/// Returns A and γ such that (u, v) = L1·(cos A, sin A) + L2·(cos(A + γ), sin(A + γ)); L1, L2 > 0.
/// `clockwise` takes γ ≤ 0. For a stretched or folded arm both roots are the same. `u_slack_m` is the open
/// part of u.
[[nodiscard]] inline TwoLinks two_r(double u, double v, double l1, double l2, bool clockwise,
                                    double u_slack_m = 0.0) noexcept {
  return bend(triangle(u, v, l1, l2, u_slack_m), clockwise);
}

}  // namespace corbot
