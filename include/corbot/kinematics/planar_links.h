// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "corbot/kinematics/closed_form.h"

namespace corbot {

/// The base and the two links in its plane, before the hand of a planar arm. planar_arm.h has frame and
/// inclinations.
struct PlanarLinks {
  double shoulder_m{};                        ///< distance of axis 2 ahead of axis 1
  double upper_m{}, fore_m{};                 ///< straight distances: axes 2 to 3, 3 to 4 (0 without axis 4)
  double upper_zero_rad{}, fore_zero_rad{};   ///< A, B at zero
  double sign2{1.0}, sign3{1.0}, sign4{1.0};  ///< +1: a positive joint value raises the links after it

  [[nodiscard]] Vector3 elbow_at_zero() const noexcept {
    return {shoulder_m + upper_m * std::cos(upper_zero_rad), 0.0, upper_m * std::sin(upper_zero_rad)};
  }
  [[nodiscard]] Vector3 wrist_at_zero() const noexcept {
    return elbow_at_zero() + Vector3{fore_m * std::cos(fore_zero_rad), 0.0, fore_m * std::sin(fore_zero_rad)};
  }

  /// Recognises the links from axes 1 to 4 (3 if the arm has no more); returns them with the arm's own frame
  /// in frame 0.
  [[nodiscard]] static std::optional<std::pair<PlanarLinks, Pose>> recognise(
      const JointChain& chain) noexcept {
    const auto& axes = chain.axes;
    const Vector3 z = axes[0].direction;
    const Vector3 across = axes[1].direction;
    if (!square(z, across) || !parallel(across, axes[2].direction)) return std::nullopt;
    if (chain.count > 3 && !parallel(across, axes[3].direction)) return std::nullopt;

    const Vector3 origin = axes[0].point_m + dot(axes[1].point_m - axes[0].point_m, z) * z;
    Vector3 y = -1.0 * across;
    const Vector3 tool = (chain.zero_T_n * chain.n_T_tool).position_m - origin;
    if (dot(tool, cross(y, z)) < -1e-6) y = across;
    const Vector3 x = cross(y, z);
    const auto ahead = [&](std::size_t i) { return dot(axes[i].point_m - origin, x); };
    const auto above = [&](std::size_t i) { return dot(axes[i].point_m - origin, z); };
    const auto sign = [&](std::size_t i) { return dot(axes[i].direction, y) < 0.0 ? 1.0 : -1.0; };

    PlanarLinks links;
    links.sign2 = sign(1);
    links.sign3 = sign(2);
    links.shoulder_m = ahead(1);
    links.upper_m = std::hypot(ahead(2) - ahead(1), above(2));
    links.upper_zero_rad = std::atan2(above(2), ahead(2) - ahead(1));
    if (links.upper_m < kRecognised) return std::nullopt;
    if (chain.count > 3) {
      links.sign4 = sign(3);
      links.fore_m = std::hypot(ahead(3) - ahead(2), above(3) - above(2));
      links.fore_zero_rad = std::atan2(above(3) - above(2), ahead(3) - ahead(2));
      if (links.fore_m < kRecognised) return std::nullopt;
    }
    return std::pair{links, Pose{origin, from_columns(x, y, z)}};
  }

  /// Computes joints 2 and 3 that reach (u, v) from the shoulder, with a forearm of this length and
  /// inclination at zero. Bit 0 of the number: joint 3 bent to its negative side. False: `solution` has the
  /// reason.
  [[nodiscard]] bool bend(double u, double v, double u_slack_m, double length_m, double length_zero_rad,
                          std::uint32_t number, const Joints& hint, IkSolution& solution,
                          double& forearm_rad) const noexcept {
    TwoLinks t = two_r(u, v, upper_m, length_m, is_clockwise(number), u_slack_m);
    if (!take(t, length_m, length_zero_rad, hint, solution)) return false;
    forearm_rad = t.first_rad + t.second_rad;
    return true;
  }
  [[nodiscard]] bool is_clockwise(std::uint32_t number) const noexcept {
    return ((number & 1u) != 0) == (sign3 > 0.0);
  }
  /// Takes joints 2 and 3 from the result of two_r; a free A becomes the hint's.
  [[nodiscard]] bool take(TwoLinks& t, double length_m, double length_zero_rad, const Joints& hint,
                          IkSolution& solution) const noexcept {
    if (t.reach != Reach::kOk) {
      solution = refused(t, upper_m, length_m);
      return false;
    }
    if (t.free) t.set_first(sign2 * hint[1] + upper_zero_rad);
    solution.status = IkStatus::kOk;
    solution.joints_q[1] = nearest_turn(sign2 * (t.first_rad - upper_zero_rad), hint[1]);
    solution.joints_q[2] = nearest_turn(sign3 * (t.second_rad - length_zero_rad + upper_zero_rad), hint[2]);
    return true;
  }
};

}  // namespace corbot
