// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot {

/// Two axes square to each other and a slide square to the second, alone or with a spherical wrist. RRP, RRP
/// + RRR (the Stanford manipulator). Siciliano et al., Robotics, 2009, 2.9.
///
/// Own frame: z along axis 1, origin at the height of axis 2, x ahead of the axis in the slide's plane at
/// zero. C is the slide's inclination, from x towards z. The last frame is at the wrist's centre, x along the
/// slide.
///
/// Solutions: bit 0: the slide's end is behind axis 2. Bit 1: the base faces away. Bit 2: the wrist's middle
/// joint is bent to its negative side.
struct PolarArm {
  static constexpr const char* kName = "polar";
  static constexpr ArmKind kKind = ArmKind::kPolar;
  static constexpr const char* kJoints = "RRP RRPRRR";
  static constexpr const char* kSingularPlaces =
      "slide along axis 1, or at the crossing of axes 1 and 2; with a wrist: axes 4 and 6 in line";

  Mounting mount{};
  SphericalWrist wrist{};
  bool has_wrist{};
  double shoulder_m{};  ///< distance of axis 2 ahead of axis 1
  /// The wrist's centre at zero: along the slide, across, square to both; else 0.
  double slide_m{}, lateral_m{}, raise_m{};
  double slide_zero_rad{};  ///< C at zero
  double sign2{1.0};        ///< +1: a positive value of joint 2 raises

  [[nodiscard]] static std::optional<PolarArm> recognise(const JointChain& chain) noexcept {
    const auto& axes = chain.axes;
    if ((chain.count != 3 && chain.count != 6) || axes[0].kind != JointKind::kRotary ||
        axes[1].kind != JointKind::kRotary || axes[2].kind != JointKind::kPrismatic) {
      return std::nullopt;
    }
    const Vector3 z = axes[0].direction;
    const Vector3 across = axes[1].direction;
    const Vector3 along = axes[2].direction;
    if (!square(z, across) || !square(across, along)) return std::nullopt;
    const Vector3 origin = axes[0].point_m + dot(axes[1].point_m - axes[0].point_m, z) * z;
    // x is ahead: the slide's direction at zero, or for an upright slide the direction from which a positive
    // joint 2 tilts it.
    Vector3 y = -1.0 * across;
    if (dot(along, cross(y, z)) < -1e-6) y = across;
    const Vector3 x = cross(y, z);
    PolarArm arm;
    arm.sign2 = dot(across, y) < 0.0 ? 1.0 : -1.0;
    arm.shoulder_m = dot(axes[1].point_m - origin, x);
    arm.slide_zero_rad = std::atan2(dot(along, z), dot(along, x));
    const Pose family{origin, from_columns(x, y, z)};
    Pose last{{arm.shoulder_m, 0.0, 0.0}, about({0.0, -1.0, 0.0}, arm.slide_zero_rad)};
    if (chain.count == 6) {
      const auto zero_T_wrist = SphericalWrist::zero_T_wrist(chain);
      if (!zero_T_wrist) return std::nullopt;
      const Vector3 centre = (inverse_of(family * last) * *zero_T_wrist).position_m;
      arm.has_wrist = true;
      arm.slide_m = centre[0];
      arm.lateral_m = centre[1];
      arm.raise_m = centre[2];
      last = last * Pose{centre, {}};
      arm.wrist = SphericalWrist::on(chain, family * last, *zero_T_wrist);
      last.orientation = last.orientation * arm.wrist.rotation({});
    }
    arm.mount = mounting(chain, family, last);
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return has_wrist ? 8 : 4; }
  [[nodiscard]] Follows follows() const noexcept { return has_wrist ? Follows::kFull : Follows::kNone; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    const double slide = sign2 * q[1] + slide_zero_rad;
    const double cc = std::cos(slide), sc = std::sin(slide);
    const double c = std::cos(q[0]), s = std::sin(q[0]);
    const double out = slide_m + q[2];
    const double r = shoulder_m + out * cc - raise_m * sc;
    Pose last{{r * c - lateral_m * s, r * s + lateral_m * c, out * sc + raise_m * cc},
              arm_rotation(q[0], slide)};
    if (has_wrist) last.orientation = last.orientation * wrist.rotation(q);
    return mount.to_base(last);
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite(hint)) return {};
    const Pose p = mount.to_family(pose);
    const Vector3& tool = mount.hand.position_m;
    if (!has_wrist) return with_output_told(*this, place(p.position_m, tool, number, hint), pose);
    const Quaternion g = p.orientation * mount.unhand;
    IkSolution solution = place(p.position_m - rotate(g, tool), {slide_m, lateral_m, raise_m}, number, hint);
    if (solution.status != IkStatus::kOk) return solution;
    Joints& q = solution.joints_q;
    const Quaternion arm = arm_rotation(q[0], sign2 * q[1] + slide_zero_rad);
    wrist.solve(conjugate(arm) * g, (number & 4u) != 0, hint, q);
    return solution;
  }
  [[nodiscard]] FollowedAngles followed() const noexcept { return {}; }
  [[nodiscard]] IkSolution inverse_at(const Vector3& position_m, const Angles&, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    if (has_wrist || number >= solution_count()) return {IkStatus::kNoSolution};
    if (!std::isfinite(position_m[0] + position_m[1] + position_m[2]) || !is_finite(hint)) return {};
    return place(mount.to_family(position_m), mount.hand.position_m, number, hint);
  }

 private:
  /// Computes the first three joints for an end at this place on the slide at zero.
  [[nodiscard]] IkSolution place(const Vector3& end, const Vector3& on_slide, std::uint32_t number,
                                 const Joints& hint) const noexcept {
    const Turn base = turn(end[0], end[1], on_slide[1], (number & 2u) != 0);
    if (base.reach != Reach::kOk) return refused(base, on_slide[1]);
    const Turn tilt = turn(base.radius_m - shoulder_m, end[2], on_slide[2], (number & 1u) != 0, base.slack_m);
    if (tilt.reach != Reach::kOk) return refused(tilt, on_slide[2]);
    IkSolution solution;
    solution.status = IkStatus::kOk;
    Joints& q = solution.joints_q;
    q[0] = base.free ? hint[0] : nearest_turn(base.angle_rad, hint[0]);
    q[1] = tilt.free ? hint[1] : nearest_turn(sign2 * (tilt.angle_rad - slide_zero_rad), hint[1]);
    q[2] = tilt.radius_m - on_slide[0];
    return solution;
  }
  /// Returns Rz(θ) Ry(−C).
  [[nodiscard]] static Quaternion arm_rotation(double base_rad, double slide_rad) noexcept {
    const double ct = std::cos(0.5 * base_rad), st = std::sin(0.5 * base_rad);
    const double cs = std::cos(0.5 * slide_rad), ss = std::sin(0.5 * slide_rad);
    return {ct * cs, st * ss, -ct * ss, st * cs};
  }
};

}  // namespace corbot
