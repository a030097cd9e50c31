// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "corbot/kinematics/path_form.h"
#include "corbot/kinematics/planar_arm.h"

// Bounds on the joints' rates along a stretch of path, for a base and planar arm with a wrist and without a
// lateral offset. The closed form gives in turn radius from the base axis, wrist position, P², sin of the
// bend, and the joints. The bounds are finite one by one, nearer to a singularity than the theorem of
// path_form.h, which needs all joints at once. Real-time safe.

namespace corbot {

/// A cell of a path: the TCP and the followed angles in its middle, and their rates.
struct PathCell {
  Vector3 position_m{};
  Vector3 velocity_m{};  ///< per unit of the path parameter
  double bend_m{};       ///< bound of the second derivative's length
  Angles angles_rad{};   ///< unless the arm follows every orientation
  /// Angular velocity of the tool, base frame, or the rates of the angles; per unit of the path parameter,
  /// constant.
  Vector3 turn_rad{};
  double half_width{};
};

struct CellRates {
  bool in_reach{};       ///< for the whole cell
  Joints rate_middle{};  ///< |q′| in the middle, 0 if singular
  Joints rate_bound{};   ///< bound of |q′| on the whole cell; may be infinite
};

/// Tells whether planar_stretch holds for this arm.
[[nodiscard]] inline bool has_planar_stretch(const PlanarArm& arm) noexcept {
  return arm.count == 4 && arm.mount.hand.position_m[1] == 0.0;
}

/// A cell in the arm's own frame, and the radius of its TCP about the base axis.
struct RadiusCell {
  Vector3 position_m{}, velocity_m{};
  double middle_m{}, low_m{};  ///< in the middle; the least anywhere on the cell
  double speed_high{};         ///< the greatest, across the base axis
};

/// Writes the base joint's rates, θ0′ = (x y′ − y x′)/ρ², into `rates`; its other bounds become infinite.
/// Real-time safe.
[[nodiscard]] inline RadiusCell planar_base_stretch(const PlanarArm& arm, const PathCell& cell,
                                                    CellRates& rates) noexcept {
  rates.rate_bound.fill(std::numeric_limits<double>::infinity());
  const double w = cell.half_width;
  RadiusCell radius{arm.mount.to_family(cell.position_m), cell.velocity_m};
  if (!arm.mount.level) radius.velocity_m = rotate(conjugate(arm.mount.base.orientation), cell.velocity_m);
  const auto [x, y, z] = radius.position_m;
  const Vector3& v = radius.velocity_m;
  const double rho = root_sum(x, y);
  const double v_xy_top = root_sum(v[0], v[1]) + cell.bend_m * w;
  const double rho_low = rho - v_xy_top * w;
  const double rho_high = rho + v_xy_top * w;
  if (rho_high <= kOnAxis_m) {
    rates.rate_bound[0] = 0.0;  // on the axis throughout: θ0 stays
  } else if (rho_low > 0.0) {
    const double across = std::abs(x * v[1] - y * v[0]);
    rates.rate_middle[0] = across / (rho * rho);
    rates.rate_bound[0] =
        std::min((across + rho_high * cell.bend_m * w) / (rho_low * rho_low), v_xy_top / rho_low);
  }
  radius.middle_m = rho;
  radius.low_m = rho_low;
  radius.speed_high = v_xy_top;
  return radius;
}

/// `q`: the joints in the middle. Notation: w half width; plain names are values in the middle; `d_name`
/// bounds the deviation of `name` from the middle, anywhere on the cell. Rounding is not directed: it is
/// fourteen digits down, and the tolerances of reach, range and speed lie above it.
[[nodiscard]] inline CellRates planar_stretch(const PlanarArm& arm, const Joints& q, std::uint32_t number,
                                              const PathCell& cell) noexcept {
  const double w = cell.half_width;
  CellRates rates;
  const RadiusCell radius = planar_base_stretch(arm, cell, rates);
  const auto [x, y, z] = radius.position_m;
  const Vector3& v = radius.velocity_m;
  const double rho = radius.middle_m, rho_low = radius.low_m, v_xy_top = radius.speed_high;

  // Wrist relative to the shoulder, (u, h), and its derivative. The tool is (ahead, above) of the wrist.
  const Vector3& tool = arm.mount.hand.position_m;
  const double hand_m = root_sum(tool[0], tool[2]);
  const double c = cell.angles_rad[0], rotation = cell.turn_rad[0];
  const double ahead = tool[0] * std::cos(c) - tool[2] * std::sin(c);
  const double above = tool[0] * std::sin(c) + tool[2] * std::cos(c);
  const double facing = (number & 2u) != 0 ? -1.0 : 1.0;
  const double u = facing * rho - arm.links.shoulder_m - ahead;
  const double h = z - above;
  const double rho_rate = rho > 0.0 ? (x * v[0] + y * v[1]) / rho : 0.0;
  const double v_u = facing * rho_rate + above * rotation;
  const double v_h = v[2] - ahead * rotation;
  const double bend = (cell.bend_m + hand_m * rotation * rotation) * w;
  // ρ″| ≤ v_xy²/ρ + bend; nearer to the axis, ρ′ is known only to lie within ±v_xy.
  const double swing =
      rho_low > 0.0 ? std::min(v_xy_top * v_xy_top / rho_low * w, 2.0 * v_xy_top) : 2.0 * v_xy_top;
  const double d_v = root_sum(swing + bend, bend);
  const double v_wrist_top = root_sum(v_u, v_h) + d_v;

  // P², and the bend from it: (2 L1 L2 sin γ)² = far · near.
  const double l1 = arm.links.upper_m, l2 = arm.links.fore_m;
  const double p_wrist = root_sum(u, h);
  const double sum = l1 + l2;
  const double difference = std::abs(l1 - l2);
  const double along = u * v_u + h * v_h;
  const double d_along = v_wrist_top * v_wrist_top * w + p_wrist * d_v;
  const double d_square = 2.0 * w * (std::abs(along) + d_along);
  const double far = (sum - p_wrist) * (sum + p_wrist);
  const double near = (p_wrist - difference) * (p_wrist + difference);
  const double far_low = far - d_square;
  const double near_low = near - d_square;
  // The tolerance is half of the inverse's tolerance.
  rates.in_reach = far_low >= -kBorder_m * sum && near_low >= -kBorder_m * difference;
  const double twice = 2.0 * l1 * l2;
  if (!(far > 0.0 && near > 0.0)) return rates;
  const double sine = std::sqrt(far * near) / twice;

  // From the wrist's velocity: A′ = (u′ cos B + h′ sin B)/(L1 sin γ),
  //                            B′ = −(u′ cos A + h′ sin A)/(L2 sin γ), γ = B − A.
  const double a = arm.links.sign2 * q[1] + arm.links.upper_zero_rad;
  const double b = arm.links.sign2 * q[1] + arm.links.sign3 * q[2] + arm.links.fore_zero_rad;
  const double top_a = v_u * std::cos(b) + v_h * std::sin(b);
  const double top_b = v_u * std::cos(a) + v_h * std::sin(a);
  const double sign = arm.links.is_clockwise(number) ? -1.0 : 1.0;
  const double b_rate = -sign * top_b / (l2 * sine);
  rates.rate_middle[1] = std::abs(top_a) / (l1 * sine);
  rates.rate_middle[2] = std::abs(along) / (l1 * l2 * sine);
  rates.rate_middle[3] = std::abs(rotation - b_rate);
  if (!(far_low > 0.0 && near_low > 0.0)) return rates;

  const double sine_low = std::sqrt(far_low * near_low) / twice;
  const double sine_high = std::sqrt((far + d_square) * (near + d_square)) / twice;
  const double d_inverse = 1.0 / sine_low - 1.0 / sine_high;  // of 1/sin γ
  const double d_angle_a = std::min(2.0, w * v_wrist_top / (l1 * sine_low));
  const double d_angle_b = std::min(2.0, w * v_wrist_top / (l2 * sine_low));
  const double d_a = ((d_v + v_wrist_top * d_angle_b) / sine_low + std::abs(top_a) * d_inverse) / l1;
  const double d_b = ((d_v + v_wrist_top * d_angle_a) / sine_low + std::abs(top_b) * d_inverse) / l2;
  const double d_bend = (d_along / sine_low + std::abs(along) * d_inverse) / (l1 * l2);
  rates.rate_bound[1] = rates.rate_middle[1] + d_a;
  rates.rate_bound[2] = rates.rate_middle[2] + std::min(d_bend, d_a + d_b);
  rates.rate_bound[3] = rates.rate_middle[3] + d_b;
  return rates;
}

/// Returns the bounds for any family: its own if it has closer ones, else those of the theorem.
[[nodiscard]] inline CellRates cell_rates(const Kinematics& arm, const Joints& q, std::uint32_t number,
                                          const PathCell& cell) noexcept {
  if (const auto* planar = std::get_if<PlanarArm>(&arm.form()); planar && has_planar_stretch(*planar)) {
    return planar_stretch(*planar, q, number, cell);
  }
  const double stray_m = cell.bend_m * cell.half_width;
  const StretchBound bound =
      PathForm(arm, q).bound({cell.velocity_m[0], cell.velocity_m[1], cell.velocity_m[2], cell.turn_rad[0],
                              cell.turn_rad[1], cell.turn_rad[2]},
                             {stray_m, stray_m, stray_m}, cell.half_width);
  CellRates rates;
  rates.in_reach = bound.is_proved;
  rates.rate_bound = bound.rate_bound;
  if (!bound.is_proved) rates.rate_bound.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    const double rate = std::abs(bound.rate_middle[i]);
    rates.rate_middle[i] = std::isfinite(rate) ? rate : 0.0;
  }
  return rates;
}

}  // namespace corbot
