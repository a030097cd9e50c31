// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/yaw_hand.h"

namespace corbot {

/// Two links in a plane, with parallel axes, and a slide square to the plane at any place of the chain. It
/// may have a hand that turns. RRP, RRPR, PRRR, and so on. Siciliano et al., Robotics, 2009, 2.9 (SCARA).
///
/// Own frame: z along the first rotary axis, x towards the second at zero. The signs are those of the axes,
/// so the family takes slides that count downward and upward.
///
/// Solutions: bit 0: the second rotary joint is bent to its negative side (from straight).
struct ScaraArm {
  static constexpr const char* kName = "SCARA";
  static constexpr ArmKind kKind = ArmKind::kScara;
  static constexpr const char* kJoints = "RRP RPR PRR RRPR RPRR PRRR RRRP";
  static constexpr const char* kSingularPlaces = "the two parallel links stretched or folded";

  Mounting mount{};
  std::uint32_t rotaries{};              ///< 2 (no hand) or 3
  std::uint32_t slide{};                 ///< the sliding joint
  std::array<std::uint32_t, 3> turns{};  ///< the rotary joints
  std::array<double, 3> signs{1.0, 1.0, 1.0};
  double slide_sign{1.0};
  /// Distances between the axes; without a hand the tool's own place counts for the second.
  double first_m{}, second_m{};
  double second_zero_rad{};  ///< direction of the second link at zero

  [[nodiscard]] static std::optional<ScaraArm> recognise(const JointChain& chain) noexcept {
    if (chain.count < 3 || chain.count > 4) return std::nullopt;
    ScaraArm arm;
    std::uint32_t slides = 0;
    for (std::uint32_t i = 0; i < chain.count; ++i) {
      if (!parallel(chain.axes[0].direction, chain.axes[i].direction)) return std::nullopt;
      if (chain.axes[i].kind == JointKind::kPrismatic) {
        ++slides;
        arm.slide = i;
      } else if (arm.rotaries < 3) {
        arm.turns[arm.rotaries++] = i;
      } else {
        return std::nullopt;
      }
    }
    if (slides != 1) return std::nullopt;

    const JointAxis& first = chain.axes[arm.turns[0]];
    const JointAxis& second = chain.axes[arm.turns[1]];
    const Vector3 z = first.direction;
    const auto from_first = [&](const Vector3& point) {
      const Vector3 away = point - first.point_m;
      return away - dot(away, z) * z;
    };
    const Vector3 link = from_first(second.point_m);
    arm.first_m = norm(link);
    if (arm.first_m < kRecognised) return std::nullopt;
    const Vector3 x = (1.0 / arm.first_m) * link;
    const Vector3 y = cross(z, x);
    for (std::size_t i = 0; i < arm.rotaries; ++i) {
      arm.signs[i] = dot(chain.axes[arm.turns[i]].direction, z) > 0.0 ? 1.0 : -1.0;
    }
    arm.slide_sign = dot(chain.axes[arm.slide].direction, z) > 0.0 ? 1.0 : -1.0;
    Pose last{{arm.first_m, 0.0, 0.0}, {}};
    if (arm.rotaries == 3) {
      const Vector3 third = from_first(chain.axes[arm.turns[2]].point_m);
      const double u = dot(third, x) - arm.first_m, v = dot(third, y);
      arm.second_m = root_sum(u, v);
      if (arm.second_m < kRecognised) return std::nullopt;
      arm.second_zero_rad = std::atan2(v, u);
      last.position_m = {arm.first_m + u, v, 0.0};
    }
    arm.mount = mounting(chain, {first.point_m, from_columns(x, y, z)}, last);
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 2; }
  [[nodiscard]] Follows follows() const noexcept { return rotaries == 3 ? Follows::kYaw : Follows::kNone; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    const double a = signs[0] * q[turns[0]];
    const double b = a + signs[1] * q[turns[1]];
    Pose last{{first_m * std::cos(a), first_m * std::sin(a), slide_sign * q[slide]}, {}};
    if (rotaries == 3) {
      last.position_m[0] += second_m * std::cos(b + second_zero_rad);
      last.position_m[1] += second_m * std::sin(b + second_zero_rad);
    }
    last.orientation = about({0.0, 0.0, 1.0}, yaw(q));
    return mount.to_base(last);
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite(hint)) return {};
    const Pose p = mount.to_family(pose);
    if (!has_hand()) return with_output_told(*this, place(p.position_m, 0.0, number, hint), pose);
    const YawHand hand = yaw_hand(mount, p.orientation, yaw(hint));
    IkSolution solution = place(p.position_m, hand.yaw_rad, number, hint);
    if (solution.status == IkStatus::kOk) solution.orientation_error_rad = hand.error_rad;
    return solution;
  }
  [[nodiscard]] IkSolution inverse_at(const Vector3& position_m, const Angles& angles, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!std::isfinite(position_m[0] + position_m[1] + position_m[2] + angles[0]) || !is_finite(hint))
      return {};
    return place(mount.to_family(position_m), angles[0], number, hint);
  }
  /// Returns the yaw as the followed angle.
  [[nodiscard]] FollowedAngles followed() const noexcept {
    FollowedAngles angles;
    angles.count = has_hand() ? 1 : 0;
    for (std::size_t i = 0; i < rotaries; ++i) angles.rows[0][turns[i]] = signs[i];
    return angles;
  }

 private:
  [[nodiscard]] bool has_hand() const noexcept { return rotaries == 3; }
  [[nodiscard]] double yaw(const Joints& q) const noexcept {
    const double sum = signs[0] * q[turns[0]] + signs[1] * q[turns[1]];
    return has_hand() ? sum + signs[2] * q[turns[2]] : sum;
  }

  [[nodiscard]] IkSolution place(const Vector3& p, double yaw_rad, std::uint32_t number,
                                 const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const Vector3 axis = has_hand() ? hand_axis(mount, p, yaw_rad) : p - Vector3{0.0, 0.0, tool[2]};
    const double length_m = has_hand() ? second_m : root_sum(tool[0], tool[1]);
    const double length_zero_rad = has_hand() ? second_zero_rad : std::atan2(tool[1], tool[0]);
    const bool clockwise = ((number & 1u) != 0) == (signs[1] > 0.0);
    const TwoLinks t = two_r(axis[0], axis[1], first_m, length_m, clockwise);
    if (t.reach != Reach::kOk) return refused(t, first_m, length_m);

    IkSolution solution;
    solution.status = IkStatus::kOk;
    Joints& q = solution.joints_q;
    const double a = t.free ? signs[0] * hint[turns[0]] : t.first_rad;
    const double bent = t.second_rad - length_zero_rad;
    q[turns[0]] = nearest_turn(signs[0] * a, hint[turns[0]]);
    q[turns[1]] = nearest_turn(signs[1] * bent, hint[turns[1]]);
    q[slide] = slide_sign * axis[2];
    if (has_hand()) q[turns[2]] = nearest_turn(signs[2] * (yaw_rad - a - bent), hint[turns[2]]);
    return solution;
  }
};

}  // namespace corbot
