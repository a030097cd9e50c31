// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/planar_links.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot {

/// Six turning joints: a base, shoulder and elbow square to it and parallel to each other, and a spherical
/// wrist. Most industrial arms have this form (PUMA, ABB, Fanuc, Kuka, Stäubli). Pieper, AIM-72, 1968; Paul
/// and Zhang, IJRR 5(2), 1986. The parameters are those of Brandstötter, Angerer, Hofbaur, ARW 2014:
/// shoulder_m is a1, lateral_m b, upper_m c2, fore_m √(a2² + c3²).
///
/// Own frame: z along axis 1, origin at the shoulder's height, x ahead of the axis on the tool's side at
/// zero. Inclinations count from x towards z. The forearm's frame Rz(θ)·Ry(−B) has x along it. The last frame
/// is the forearm's frame turned by the wrist, with its origin at the wrist's centre.
///
/// Solutions: bit 0: joint 3 is bent to its negative side (from straight). Bit 1: the base faces away from
/// the wrist's centre. Bit 2: joint 5 is bent to its negative side. With a straight or folded wrist joint 4
/// is the hint's. With the centre on axis 1 joint 1 is the hint's.
struct OrthoParallelArm {
  static constexpr const char* kName = "ortho-parallel arm with spherical wrist";
  static constexpr ArmKind kKind = ArmKind::kAnthropomorphic;
  static constexpr const char* kJoints = "RRRRRR";
  static constexpr const char* kSingularPlaces =
      "elbow stretched or folded; wrist centre on axis 1; axes 4 and 6 in line";
  static constexpr std::uint32_t kSolutions = 8;

  Mounting mount{};
  PlanarLinks links{};  ///< the forearm ends at the wrist's centre
  SphericalWrist wrist{};
  double lateral_m{};  ///< distance of the wrist's centre from axis 1's plane

  [[nodiscard]] static std::optional<OrthoParallelArm> recognise(const JointChain& chain) noexcept {
    if (chain.count != 6) return std::nullopt;
    for (const JointAxis& axis : chain.axes) {
      if (axis.kind != JointKind::kRotary) return std::nullopt;
    }
    const auto zero_T_wrist = SphericalWrist::zero_T_wrist(chain);
    JointChain first = chain;
    first.count = 3;
    const auto links = PlanarLinks::recognise(first);
    if (!zero_T_wrist || !links) return std::nullopt;

    OrthoParallelArm arm;
    arm.links = links->first;
    const Pose& family = links->second;
    const Vector3 centre = (inverse_of(family) * *zero_T_wrist).position_m;
    const Vector3 forearm = centre - arm.links.elbow_at_zero();
    arm.lateral_m = centre[1];
    arm.links.fore_m = root_sum(forearm[0], forearm[2]);
    arm.links.fore_zero_rad = std::atan2(forearm[2], forearm[0]);
    if (arm.links.fore_m < kRecognised) return std::nullopt;
    Pose last{centre, about({0.0, -1.0, 0.0}, arm.links.fore_zero_rad)};
    arm.wrist = SphericalWrist::on(chain, family * last, *zero_T_wrist);
    last.orientation = last.orientation * arm.wrist.rotation({});
    arm.mount = mounting(chain, family, last);
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return kSolutions; }
  [[nodiscard]] Follows follows() const noexcept { return Follows::kFull; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    const double upper = links.sign2 * q[1] + links.upper_zero_rad;
    const double bent = links.sign2 * q[1] + links.sign3 * q[2];
    const double fore = bent + links.fore_zero_rad;
    const double r = links.shoulder_m + links.upper_m * std::cos(upper) + links.fore_m * std::cos(fore);
    const double z = links.upper_m * std::sin(upper) + links.fore_m * std::sin(fore);
    const double c = std::cos(q[0]), s = std::sin(q[0]);
    const Pose last{{r * c - lateral_m * s, r * s + lateral_m * c, z},
                    arm_rotation({std::cos(0.5 * q[0]), std::sin(0.5 * q[0])},
                                 {std::cos(0.5 * fore), std::sin(0.5 * fore)}) *
                        wrist.rotation(q)};
    return mount.base * (last * mount.hand);
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= kSolutions) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite_hint(hint)) return {};
    const Wanted wanted = wanted_of(pose);
    const Turn base = turn(wanted.centre_m[0], wanted.centre_m[1], lateral_m, (number & 2u) != 0);
    if (base.reach != Reach::kOk) return refused(base, lateral_m);
    const Triangle plane = triangle_of(base, wanted);
    const Heading heading = heading_of(base, plane, wanted, hint);
    IkSolution solution;
    Quaternion arm_R_last;
    if (reach(heading, plane, wanted, number, hint, solution, arm_R_last)) {
      wrist.solve(arm_R_last, (number & 4u) != 0, hint, solution.joints_q);
    }
    return solution;
  }

  /// Computes inverse() for every number; the common parts are computed once.
  void inverse_all(const Pose& pose, const Joints& hint,
                   std::array<IkSolution, kSolutions>& all) const noexcept {
    if (!is_finite(pose) || !is_finite_hint(hint)) {
      all.fill({});
      return;
    }
    const Wanted wanted = wanted_of(pose);
    for (std::uint32_t away = 0; away < 4; away += 2) {
      const Turn base = turn(wanted.centre_m[0], wanted.centre_m[1], lateral_m, away != 0);
      if (base.reach != Reach::kOk) {
        for (const std::uint32_t bits : {0u, 1u, 4u, 5u}) all[away + bits] = refused(base, lateral_m);
        continue;
      }
      const Triangle plane = triangle_of(base, wanted);
      const Heading heading = heading_of(base, plane, wanted, hint);
      for (std::uint32_t number = away; number < away + 2; ++number) {
        IkSolution& solution = all[number];
        IkSolution& flipped = all[number + 4];
        Quaternion arm_R_last;
        solution = {};
        const bool reaches = reach(heading, plane, wanted, number, hint, solution, arm_R_last);
        flipped = solution;
        if (reaches) wrist.solve_both(arm_R_last, hint, solution.joints_q, flipped.joints_q);
      }
    }
  }

 private:
  struct Wanted {
    Quaternion last{};  ///< rotation of the last frame
    Vector3 centre_m{};
  };
  [[nodiscard]] Wanted wanted_of(const Pose& pose) const noexcept {
    const Pose p = mount.to_family(pose);
    const Quaternion last = p.orientation * mount.unhand;
    return {last, p.position_m - rotate(last, mount.hand.position_m)};
  }
  [[nodiscard]] static bool is_finite_hint(const Joints& q) noexcept {
    return std::isfinite(q[0] + q[1] + q[2] + q[3] + q[4] + q[5]);
  }
  struct Heading {
    double base_rad;
    HalfAngle half;
  };
  /// If two borders meet, the elbow's border has moved the centre within its plane. Joint 1 then follows.
  [[nodiscard]] Heading heading_of(const Turn& base, const Triangle& plane, const Wanted& wanted,
                                   const Joints& hint) const noexcept {
    if (base.free) return {hint[0], {std::cos(0.5 * hint[0]), std::sin(0.5 * hint[0])}};
    double angle = base.angle_rad, cosine = base.cosine, sine = base.sine;
    if (plane.u != base.radius_m - links.shoulder_m) {
      const double radius = plane.u + links.shoulder_m;
      const double x = wanted.centre_m[0], y = wanted.centre_m[1];
      const double k = 1.0 / (base.distance_m * root_sum(radius, lateral_m));
      cosine = k * (x * radius + y * lateral_m);
      sine = k * (y * radius - x * lateral_m);
      angle = arc_tangent(sine, cosine);
    }
    return {nearest_turn(angle, hint[0]), half_angle(cosine, sine)};
  }
  [[nodiscard]] Triangle triangle_of(const Turn& base, const Wanted& wanted) const noexcept {
    return triangle(base.radius_m - links.shoulder_m, wanted.centre_m[2], links.upper_m, links.fore_m,
                    base.slack_m);
  }
  /// Computes joints 1 to 3, and the last frame's rotation seen from the forearm. False: `solution` has the
  /// reason.
  [[nodiscard]] bool reach(const Heading& heading, const Triangle& plane, const Wanted& wanted,
                           std::uint32_t number, const Joints& hint, IkSolution& solution,
                           Quaternion& arm_R_last) const noexcept {
    TwoLinks t = bend(plane, links.is_clockwise(number));
    if (!links.take(t, links.fore_m, links.fore_zero_rad, hint, solution)) return false;
    solution.joints_q[0] = heading.base_rad;
    arm_R_last = conjugate(arm_rotation(heading.half, half_angle(t.cosine, t.sine))) * wanted.last;
    return true;
  }
  /// Returns Rz(θ) Ry(−B).
  [[nodiscard]] static Quaternion arm_rotation(const HalfAngle& base, const HalfAngle& fore) noexcept {
    return {base.cosine * fore.cosine, base.sine * fore.sine, -base.cosine * fore.sine,
            base.sine * fore.cosine};
  }
};

}  // namespace corbot
