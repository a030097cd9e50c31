// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/yaw_hand.h"

namespace corbot {

/// A base that turns, a slide along its axis and one square to it, in either order. It may have a hand that
/// turns about a parallel axis. RPP, RPPR. Siciliano et al., Robotics, 2009, 2.9 (cylindrical arm).
///
/// Own frame: z along axis 1, x along the slide that reaches out, at zero.
///
/// Solutions: bit 0: the arm reaches to behind its axis.
struct CylindricalArm {
  static constexpr const char* kName = "cylindrical";
  static constexpr ArmKind kKind = ArmKind::kCylindrical;
  static constexpr const char* kJoints = "RPP RPPR";
  static constexpr const char* kSingularPlaces =
      "the tool as near to axis 1 as the arm's lateral offset lets it";

  Mounting mount{};
  std::uint32_t count{};          ///< 3 or 4 joints
  std::uint32_t lift{}, reach{};  ///< the numbers of the lifting joint and the reaching joint
  double lift_sign{1.0};
  double hand_sign{1.0};
  double ahead_m{}, lateral_m{};  ///< the hand's axis at zero; without a hand the tool's own place counts

  [[nodiscard]] static std::optional<CylindricalArm> recognise(const JointChain& chain) noexcept {
    if (chain.count < 3 || chain.count > 4) return std::nullopt;
    const auto& axes = chain.axes;
    if (axes[0].kind != JointKind::kRotary || axes[1].kind != JointKind::kPrismatic ||
        axes[2].kind != JointKind::kPrismatic) {
      return std::nullopt;
    }
    CylindricalArm arm;
    arm.count = chain.count;
    const Vector3 z = axes[0].direction;
    arm.lift = parallel(axes[1].direction, z) ? 1 : 2;
    arm.reach = 3 - arm.lift;
    const Vector3 x = axes[arm.reach].direction;
    if (!parallel(axes[arm.lift].direction, z) || !square(x, z)) return std::nullopt;
    arm.lift_sign = dot(axes[arm.lift].direction, z) > 0.0 ? 1.0 : -1.0;
    const Vector3 y = cross(z, x);
    if (chain.count == 4) {
      if (axes[3].kind != JointKind::kRotary || !parallel(axes[3].direction, z)) return std::nullopt;
      arm.hand_sign = dot(axes[3].direction, z) > 0.0 ? 1.0 : -1.0;
      const Vector3 away = axes[3].point_m - axes[0].point_m;
      arm.ahead_m = dot(away, x);
      arm.lateral_m = dot(away, y);
    }
    arm.mount =
        mounting(chain, {axes[0].point_m, from_columns(x, y, z)}, {{arm.ahead_m, arm.lateral_m, 0.0}, {}});
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 2; }
  [[nodiscard]] Follows follows() const noexcept { return count == 4 ? Follows::kYaw : Follows::kNone; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    const double c = std::cos(q[0]), s = std::sin(q[0]);
    const double r = ahead_m + q[reach];
    const double yaw = count == 4 ? q[0] + hand_sign * q[3] : q[0];
    const Pose last{{r * c - lateral_m * s, r * s + lateral_m * c, lift_sign * q[lift]},
                    about({0.0, 0.0, 1.0}, yaw)};
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
    angles.rows[0] = {1.0, 0.0, 0.0, hand_sign};
    return angles;
  }

 private:
  [[nodiscard]] bool has_hand() const noexcept { return count == 4; }
  [[nodiscard]] double yaw(const Joints& q) const noexcept { return q[0] + hand_sign * q[3]; }

  [[nodiscard]] IkSolution place(const Vector3& p, double yaw_rad, std::uint32_t number,
                                 const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const Vector3 axis = has_hand() ? hand_axis(mount, p, yaw_rad) : p - Vector3{0.0, 0.0, tool[2]};
    const double offset = has_hand() ? lateral_m : tool[1];
    const Turn t = turn(axis[0], axis[1], offset, number != 0);
    if (t.reach != Reach::kOk) return refused(t, offset);

    IkSolution solution;
    solution.status = IkStatus::kOk;
    Joints& q = solution.joints_q;
    q[0] = t.free ? hint[0] : nearest_turn(t.angle_rad, hint[0]);
    q[reach] = t.radius_m - (has_hand() ? ahead_m : tool[0]);
    q[lift] = lift_sign * axis[2];
    if (has_hand()) q[3] = nearest_turn(hand_sign * (yaw_rad - q[0]), hint[3]);
    return solution;
  }
};

}  // namespace corbot
