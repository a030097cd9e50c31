// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "corbot/kinematics/angles.h"
#include "corbot/kinematics/branch.h"
#include "corbot/kinematics/geometry.h"
#include "corbot/kinematics/ik_status.h"
#include "corbot/kinematics/joints.h"

// Closed-form kinematics of the Lynx family, after section IV of 'A CORBA Wrapper for Applications with
// Multiple Robots'. Base frame: origin on the base axis at table height, z up. Metres and radians. Everything
// here is real-time safe: no allocation, no lock, no system call,
// no loop without a constant bound. See docs/kinematics.md.

namespace corbot {

/// Where the tool centre point is and how the tool points, base frame. Roll is always 0 for this arm.
struct ToolPose {
  std::array<double, 3> position_m{};
  double yaw_rad{};    ///< θ0 with its offset: heading of the arm's plane
  double pitch_rad{};  ///< C: tool pitch above the horizontal, positive upward
};

struct IkResult {
  IkStatus status{IkStatus::kNotFinite};
  Joints position_q{};        ///< all zero unless status is kOk
  double wrist_distance_m{};  ///< P: shoulder to wrist, as the target asks
  double min_m{};             ///< |L1 − L2|
  double max_m{};             ///< L1 + L2
};

/// A wrist that misses the border of the workspace by no more than this part of (L1 + L2) counts as on it:
/// rounding must not turn a stretched arm into an error. With equal links that is 1e-12 on cos θ2 at the
/// stretched border (6e-14 m for the Lynx 5), hundreds of times the rounding of a round trip.
inline constexpr double kBorderTolerance = 2.5e-13;

/// Nearer to the base axis than this, θ0 is free and the hint is kept.
inline constexpr double kAxisTolerance_m = 1e-13;

/// A joint value from inverse kinematics may miss its range by this much: next to the stretched or the folded
/// arm half of the digits go, so that 1e-16 m of rounding becomes 1e-8 rad. 1e-7 rad is a thousandth of a
/// servo's step.
inline constexpr double kRangeTolerance_q = 1e-7;

[[nodiscard]] constexpr bool is_backward(Branch branch) noexcept {
  return (static_cast<std::uint32_t>(branch) & 2u) != 0;
}
[[nodiscard]] constexpr bool is_negative(Branch branch) noexcept {
  return (static_cast<std::uint32_t>(branch) & 1u) != 0;
}

namespace detail {

/// Inclinations of upper arm (A), forearm (B) and tool (C) above the horizontal. The elbow rotates the other
/// way from the rest: link 2 of Table II has α = 180°, which reverses the sense of θ2,
/// and link 3 restores it.
struct Inclinations {
  double a_rad, b_rad, c_rad;
};

[[nodiscard]] inline Inclinations inclinations(const ArmGeometry& arm, const Joints& q) noexcept {
  const double a = q[1] + arm.offset_rad[1];
  const double b = a - (q[2] + arm.offset_rad[2]);
  return {a, b, b + (q[3] + arm.offset_rad[3])};
}

}  // namespace detail

/// Forward kinematics, eqs. (3)–(5): equal to the product of the four D-H matrices of Table II.
/// Erratum, eq. (2): the printed matrix has a·Sθ in row 1, column 4, and a·Cθ in row 2; they are the wrong
/// way round. Only with a·Cθ in row 1 does the product give the paper's own eqs. (3)–(5).
[[nodiscard]] inline ToolPose forward(const ArmGeometry& arm, const Joints& q) noexcept {
  const auto [a, b, c] = detail::inclinations(arm, q);
  const double r = arm.l1_m * std::cos(a) + arm.l2_m * std::cos(b) + arm.l3_m * std::cos(c);
  const double z = arm.l0_m + arm.l1_m * std::sin(a) + arm.l2_m * std::sin(b) + arm.l3_m * std::sin(c);
  const double yaw = q[0] + arm.offset_rad[0];
  return {{r * std::cos(yaw), r * std::sin(yaw), z}, yaw, c};
}

/// The branch on which these joints lie; θ2 = 0 and a TCP on the base axis count as positive and forward.
[[nodiscard]] inline Branch branch_of(const ArmGeometry& arm, const Joints& q) noexcept {
  const auto [a, b, c] = detail::inclinations(arm, q);
  const double r = arm.l1_m * std::cos(a) + arm.l2_m * std::cos(b) + arm.l3_m * std::cos(c);
  const std::uint32_t backward = r < -kAxisTolerance_m ? 2u : 0u;
  const std::uint32_t negative = q[2] + arm.offset_rad[2] < 0.0 ? 1u : 0u;
  return static_cast<Branch>(backward | negative);
}

/// Inverse kinematics for a tool pitch `pitch_rad`, on one branch. Angles are returned in (−π, π]; checking
/// ranges is left to the caller. Corrected equations:
/// - (6) prints arctan(Py/Px), which loses the quadrant: atan2.
/// - (7) yields A, not θ1 (the −10° offset is missing), and its arcsin((Pz − L0)/P) loses a wrist behind the
///   shoulder: atan2(h, u).
/// - (8) prints a minus sign in the arccos: that is the interior angle at the elbow, while (3)–(5) use the
///   exterior one.
/// The elbow comes from its half angle, tan(θ2/2) = √((L1+L2)² − P²) / √(P² − (L1−L2)²), because acos loses
/// half of the digits at the borders; differences of squares are factored for the same reason. On the base
/// axis (ρ ≤ kAxisTolerance_m) θ0 is the hint. With P = 0, possible only where L1 = L2, the arm is folded and
/// its direction is free: the upper arm is put upright (A = 90°).
[[nodiscard]] inline IkResult inverse(const ArmGeometry& arm, const std::array<double, 3>& position_m,
                                      double pitch_rad, Branch branch, double theta0_hint_rad) noexcept {
  IkResult result;
  const double sum = arm.l1_m + arm.l2_m;
  const double difference = std::abs(arm.l1_m - arm.l2_m);
  result.min_m = difference;
  result.max_m = sum;
  if (!(std::isfinite(position_m[0]) && std::isfinite(position_m[1]) && std::isfinite(position_m[2]) &&
        std::isfinite(pitch_rad) && std::isfinite(theta0_hint_rad))) {
    return result;
  }
  const double facing = is_backward(branch) ? -1.0 : 1.0;
  const double rho = std::hypot(position_m[0], position_m[1]);
  const double u = facing * rho - arm.l3_m * std::cos(pitch_rad);
  const double h = position_m[2] - arm.l0_m - arm.l3_m * std::sin(pitch_rad);
  const double p = std::hypot(u, h);  // (10)
  result.wrist_distance_m = p;
  const double tolerance = kBorderTolerance * sum;
  if (p > sum + tolerance) {
    result.status = IkStatus::kTooFar;
    return result;
  }
  if (p < difference - tolerance) {
    result.status = IkStatus::kTooClose;
    return result;
  }
  const double to_stretched = std::fmax(0.0, (sum - p) * (sum + p));
  const double to_folded = std::fmax(0.0, (p - difference) * (p + difference));
  const double sign = is_negative(branch) ? -1.0 : 1.0;
  const double y = std::sqrt(to_stretched);
  const double x = std::sqrt(to_folded);
  const double elbow = sign * 2.0 * std::atan2(y, x);
  // atan2(L2 sin θ2, L1 + L2 cos θ2), both times 2 L1, without the cancellation near the folded arm.
  const double offset = std::atan2(sign * x * y, 2.0 * arm.l1_m * (arm.l1_m - arm.l2_m) + to_folded);
  const double a = p > 0.0 ? std::atan2(h, u) + offset : std::numbers::pi / 2.0;

  result.status = IkStatus::kOk;
  result.position_q[0] =
      rho > kAxisTolerance_m
          ? wrap_angle(std::atan2(facing * position_m[1], facing * position_m[0]) - arm.offset_rad[0])
          : theta0_hint_rad;
  result.position_q[1] = wrap_angle(a - arm.offset_rad[1]);
  const double theta2 = elbow - arm.offset_rad[2];
  // A folded arm keeps the sign of its branch: −π stays −π.
  result.position_q[2] = std::abs(theta2) <= std::numbers::pi ? theta2 : wrap_angle(theta2);
  result.position_q[3] = wrap_angle(pitch_rad - a + elbow - arm.offset_rad[3]);  // (9)
  return result;
}

}  // namespace corbot
