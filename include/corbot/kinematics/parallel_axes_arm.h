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

/// Six turning joints: axes 2 to 4 parallel to each other and square to axis 1, axis 5 square to axis 4, axis
/// 6 square to and crossing axis 5. Universal Robots and similar arms. Hawkins, Georgia Tech, 2013, has the
/// solution with arc cosines.
///
/// Own frame: z along axis 1, origin at the shoulder's height, x ahead of the axis on the tool's side at
/// zero. Inclinations count from x towards z; C is the hand's. The hand's frame Rz(θ)·Ry(−C) has z along axis
/// 5. The last frame is Rz(θ)·Ry(−C)·Rz(q5 + zero)·Ry(±q6), with its origin at the crossing of axes 5 and 6.
///
/// Solutions: bit 0: joint 3 is bent to its negative side (from straight). Bit 1: the base faces away from
/// the crossing. Bit 2: joint 5's angle between axes 4 and 6 is negative. If axes 4 and 6 are parallel, joint
/// 6 is the hint's, or the nearest that reaches. If the crossing is on axis 1 (with no lateral offset only),
/// joint 1 is the hint's, or refused.
struct ParallelAxesArm {
  static constexpr const char* kName = "arm with three parallel axes";
  static constexpr ArmKind kKind = ArmKind::kAnthropomorphic;
  static constexpr const char* kJoints = "RRRRRR";
  static constexpr const char* kSingularPlaces =
      "elbow stretched or folded; axes 4 and 6 parallel; wrist at its offset from axis 1";
  static constexpr std::uint32_t kSolutions = 8;

  Mounting mount{};
  PlanarLinks links{};
  double lateral_m{};             ///< distance of the crossing of axes 5 and 6 from axis 1's plane
  double hand_x_m{}, hand_z_m{};  ///< from axis 4 to the crossing, in the hand's frame
  double hand_zero_rad{};         ///< C at zero
  double middle_zero_rad{};       ///< from axis 4 to axis 6 about axis 5, at zero

  [[nodiscard]] static std::optional<ParallelAxesArm> recognise(const JointChain& chain) noexcept {
    if (chain.count != 6) return std::nullopt;
    for (const JointAxis& axis : chain.axes) {
      if (axis.kind != JointKind::kRotary) return std::nullopt;
    }
    const JointAxis &fifth = chain.axes[4], &sixth = chain.axes[5];
    if (!square(chain.axes[3].direction, fifth.direction) || !square(fifth.direction, sixth.direction)) {
      return std::nullopt;
    }
    const auto links = PlanarLinks::recognise(chain);
    const auto cross = crossing(fifth, sixth);
    if (!links || !cross) return std::nullopt;

    ParallelAxesArm arm;
    arm.links = links->first;
    const Pose& family = links->second;
    const Quaternion to_family = conjugate(family.orientation);
    const Vector3 c = rotate(to_family, *cross - family.position_m);
    const Vector3 along5 = rotate(to_family, fifth.direction);
    const Vector3 along6 = rotate(to_family, sixth.direction);
    arm.hand_zero_rad = std::atan2(-along5[0], along5[2]);  // Ry(−C) z = (−sin C, 0, cos C)
    const Quaternion hand = about({0.0, -1.0, 0.0}, arm.hand_zero_rad);
    const Vector3 out = rotate(conjugate(hand), c - arm.links.wrist_at_zero());
    const Vector3 axis6 = rotate(conjugate(hand), along6);  // (−sin, cos, 0) of the angle from axis 4's y
    arm.lateral_m = c[1];
    arm.hand_x_m = out[0];
    arm.hand_z_m = out[2];
    arm.middle_zero_rad = std::atan2(-axis6[0], axis6[1]);
    arm.mount = mounting(chain, family, {c, hand * about({0.0, 0.0, 1.0}, arm.middle_zero_rad)});
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
    const double hand = bent + links.sign4 * q[3] + hand_zero_rad;
    const double fore = bent + links.fore_zero_rad;
    const double ch = std::cos(0.5 * hand), sh = std::sin(0.5 * hand);
    const double cc = (ch - sh) * (ch + sh), sc = 2.0 * sh * ch;
    const double r = links.shoulder_m + links.upper_m * std::cos(upper) + links.fore_m * std::cos(fore) +
                     hand_x_m * cc - hand_z_m * sc;
    const double z =
        links.upper_m * std::sin(upper) + links.fore_m * std::sin(fore) + hand_x_m * sc + hand_z_m * cc;
    const double ct = std::cos(0.5 * q[0]), st = std::sin(0.5 * q[0]);
    const double c = (ct - st) * (ct + st), s = 2.0 * st * ct;
    const Quaternion arm{ct * ch, st * sh, -ct * sh, st * ch};  // Rz(θ) Ry(−C)
    const double middle = 0.5 * (q[4] + middle_zero_rad);
    const double cm = std::cos(middle), sm = std::sin(middle);
    const double cl = std::cos(0.5 * q[5]), sl = std::sin(0.5 * q[5]);
    const Quaternion wrist{cm * cl, -sm * sl, cm * sl, sm * cl};  // Rz(middle) Ry(last)
    return mount.base * (Pose{{r * c - lateral_m * s, r * s + lateral_m * c, z}, arm * wrist} * mount.hand);
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= kSolutions) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite_hint(hint)) return {};
    const Wanted wanted = wanted_of(pose);
    const Turn base = turn(wanted.crossing_m[0], wanted.crossing_m[1], lateral_m, (number & 2u) != 0);
    if (base.reach != Reach::kOk) return refused(base, lateral_m);
    const double base_rad = base.free ? hint[0] : nearest_turn(base.angle_rad, hint[0]);
    const Zyz wrist = wrist_of(wanted, half_of(base, hint), (number & 4u) != 0, hint);
    return rest(wanted, base, base_rad, wrist, triangle_of(wanted, base, wrist), number, hint);
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
      const Turn base = turn(wanted.crossing_m[0], wanted.crossing_m[1], lateral_m, away != 0);
      if (base.reach != Reach::kOk) {
        for (const std::uint32_t bits : {0u, 1u, 4u, 5u}) all[away + bits] = refused(base, lateral_m);
        continue;
      }
      const double base_rad = base.free ? hint[0] : nearest_turn(base.angle_rad, hint[0]);
      const Zyz straight = wrist_of(wanted, half_of(base, hint), false, hint);
      for (std::uint32_t flip = 0; flip < 8; flip += 4) {
        const Zyz wrist = flip != 0 ? flipped(straight) : straight;
        const Triangle plane = triangle_of(wanted, base, wrist);
        for (std::uint32_t number = away + flip; number < away + flip + 2; ++number) {
          all[number] = rest(wanted, base, base_rad, wrist, plane, number, hint);
        }
      }
    }
  }

 private:
  /// The greatest orientation error if a border leaves a joint open.
  static constexpr double kMostOpen_rad = 1e-10;
  struct Wanted {
    Quaternion last{};  ///< rotation of the last frame
    Vector3 crossing_m{};
  };
  [[nodiscard]] Wanted wanted_of(const Pose& pose) const noexcept {
    const Pose p = mount.to_family(pose);
    const Quaternion last = p.orientation * mount.unhand;
    return {last, p.position_m - rotate(last, mount.hand.position_m)};
  }
  [[nodiscard]] static bool is_finite_hint(const Joints& q) noexcept {
    return std::isfinite(q[0] + q[1] + q[2] + q[3] + q[4] + q[5]);
  }
  [[nodiscard]] static HalfAngle half_of(const Turn& base, const Joints& hint) noexcept {
    if (base.free) return {std::cos(0.5 * hint[0]), std::sin(0.5 * hint[0])};
    return half_angle(base.cosine, base.sine);
  }
  /// Inverts Ry(−C)·Rz(middle)·Ry(last), with its axes renamed (x, y, z → −x, z, y). `first` is −last, so
  /// that the hint is joint 6; `middle` is −middle, and `last` is C.
  [[nodiscard]] static Zyz wrist_of(const Wanted& wanted, const HalfAngle& half, bool flip,
                                    const Joints& hint) noexcept {
    const double ct = half.cosine, st = half.sine;
    const Quaternion& g = wanted.last;
    const Quaternion rel{ct * g.w + st * g.z, ct * g.x + st * g.y, ct * g.y - st * g.x, ct * g.z - st * g.w};
    return zyz({rel.w, rel.x, -rel.z, -rel.y}, !flip, -hint[5]);
  }
  /// Returns the triangle of the two links with the hand at C.
  [[nodiscard]] Triangle triangle_of(const Wanted& wanted, const Turn& base, double cc,
                                     double sc) const noexcept {
    return triangle(base.radius_m - links.shoulder_m - hand_x_m * cc + hand_z_m * sc,
                    wanted.crossing_m[2] - hand_x_m * sc - hand_z_m * cc, links.upper_m, links.fore_m,
                    base.slack_m);
  }
  [[nodiscard]] Triangle triangle_of(const Wanted& wanted, const Turn& base,
                                     const Zyz& wrist) const noexcept {
    if (wrist.free) return triangle_of(wanted, base, std::cos(wrist.last_rad), std::sin(wrist.last_rad));
    return triangle_of(wanted, base, wrist.last_cosine, wrist.last_sine);
  }
  /// Computes joints 2 to 4. False: `solution` has the reason.
  [[nodiscard]] bool reach(const Triangle& plane, double hand, std::uint32_t number, const Joints& hint,
                           IkSolution& solution) const noexcept {
    TwoLinks t = bend(plane, links.is_clockwise(number));
    if (!links.take(t, links.fore_m, links.fore_zero_rad, hint, solution)) return false;
    const double fore = t.first_rad + t.second_rad;
    solution.joints_q[3] =
        nearest_turn(links.sign4 * (hand - hand_zero_rad - fore + links.fore_zero_rad), hint[3]);
    return true;
  }
  /// Returns the change of C that brings axis 4 to the limit's distance from axis 2: the smaller of two.
  [[nodiscard]] double to_limit(const Wanted& wanted, const Turn& base, double hand,
                                double limit_m) const noexcept {
    const double u = base.radius_m - links.shoulder_m, v = wanted.crossing_m[2];
    const double s = root_sum(u, v), h = root_sum(hand_x_m, hand_z_m);
    const double difference = std::abs(s - h), sum = s + h;
    const double there =
        2.0 * std::atan2(std::sqrt(std::fmax(0.0, (limit_m - difference) * (limit_m + difference))),
                         std::sqrt(std::fmax(0.0, (sum - limit_m) * (sum + limit_m))));
    const double now = wrap_angle(hand + std::atan2(hand_z_m, hand_x_m) - std::atan2(v, u));
    return std::copysign(there, now) - now;
  }
  [[nodiscard]] IkSolution rest(const Wanted& wanted, const Turn& base, double base_rad, const Zyz& wrist,
                                const Triangle& plane, std::uint32_t number,
                                const Joints& hint) const noexcept {
    IkSolution solution;
    if (!reach(plane, wrist.last_rad, number, hint, solution)) {
      return next_to_border(wanted, base, base_rad, wrist, solution, number, hint);
    }
    set_outer(base_rad, wrist, hint, solution.joints_q);
    return solution;
  }
  void set_outer(double base_rad, const Zyz& wrist, const Joints& hint, Joints& q) const noexcept {
    q[0] = base_rad;
    q[4] = nearest_turn(-wrist.middle_rad - middle_zero_rad, hint[4]);
    q[5] = nearest_turn(-wrist.first_rad, hint[5]);
  }
  /// Next to parallel axes 4 and 6 the wrist leaves C open, by the ratio of rounding (and a base at its
  /// border) to their angle. If they are parallel, C is free, and C decides whether the links reach. The
  /// function then takes the nearest C with which they reach, and joint 6 compensates. Otherwise the refusal
  /// stands.
  [[nodiscard]] IkSolution next_to_border(const Wanted& wanted, const Turn& base, double base_rad, Zyz wrist,
                                          const IkSolution& refusal, std::uint32_t number,
                                          const Joints& hint) const noexcept {
    const double tilted = std::abs(std::sin(0.5 * wrist.middle_rad));
    const double upright = std::abs(std::cos(0.5 * wrist.middle_rad));
    const double change = to_limit(wanted, base, wrist.last_rad, refusal.limit_m);
    const double error_rad = 2.0 * std::abs(change) * std::fmin(tilted, upright);
    const double open_rad =
        std::fmin(4.0 * kRounding_m + 2.0 * (kRounding_m + base.slack_m) / base.distance_m, kMostOpen_rad);
    if (!wrist.free && error_rad > open_rad) return refusal;
    wrist.last_rad += change;
    wrist.first_rad += tilted <= upright ? -change : change;
    const double cc = std::cos(wrist.last_rad), sc = std::sin(wrist.last_rad);
    IkSolution solution;
    if (!reach(triangle_of(wanted, base, cc, sc), wrist.last_rad, number, hint, solution)) return refusal;
    solution.orientation_error_rad = wrist.free ? 0.0 : error_rad;
    set_outer(base_rad, wrist, hint, solution.joints_q);
    return solution;
  }
};

}  // namespace corbot
