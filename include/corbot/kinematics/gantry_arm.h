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

/// Three slides in independent directions, and perhaps a hand that turns: PPP, PPPR. Never singular.
///
/// Own frame: at the hand at zero, z along its axis (without a hand: parallel to frame 0).
///
/// Solutions: one.
struct GantryArm {
  static constexpr const char* kName = "gantry";
  static constexpr ArmKind kKind = ArmKind::kCartesian;
  static constexpr const char* kJoints = "PPP PPPR";
  static constexpr const char* kSingularPlaces = "none";

  Mounting mount{};
  std::uint32_t count{};              ///< 3 or 4 joints
  std::array<Vector3, 3> slides{};    ///< their directions
  std::array<Vector3, 3> measures{};  ///< the dual directions: slide i of a displacement d is d · measures[i]

  [[nodiscard]] static std::optional<GantryArm> recognise(const JointChain& chain) noexcept {
    if (chain.count < 3 || chain.count > 4) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      if (chain.axes[i].kind != JointKind::kPrismatic) return std::nullopt;
    }
    if (chain.count == 4 && chain.axes[3].kind != JointKind::kRotary) return std::nullopt;
    GantryArm arm;
    arm.count = chain.count;
    Pose family;
    if (chain.count == 4) {
      const Vector3 z = chain.axes[3].direction;
      const Vector3 least = std::abs(z[0]) < 0.6 ? Vector3{1.0, 0.0, 0.0} : Vector3{0.0, 1.0, 0.0};
      const Vector3 across = cross(z, least);
      const Vector3 y = (1.0 / norm(across)) * across;
      family = {chain.axes[3].point_m, from_columns(cross(y, z), y, z)};
    }
    const Quaternion to_family = conjugate(family.orientation);
    for (std::size_t i = 0; i < 3; ++i) arm.slides[i] = rotate(to_family, chain.axes[i].direction);
    const double volume = dot(arm.slides[0], cross(arm.slides[1], arm.slides[2]));
    if (std::abs(volume) < 1e-3) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      arm.measures[i] = (1.0 / volume) * cross(arm.slides[(i + 1) % 3], arm.slides[(i + 2) % 3]);
    }
    arm.mount = mounting(chain, family, {});
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 1; }
  [[nodiscard]] Follows follows() const noexcept { return count == 4 ? Follows::kYaw : Follows::kNone; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    Pose last{q[0] * slides[0] + q[1] * slides[1] + q[2] * slides[2], {}};
    if (count == 4) last.orientation = about({0.0, 0.0, 1.0}, q[3]);
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
    angles.rows[0][3] = 1.0;
    return angles;
  }

 private:
  [[nodiscard]] bool has_hand() const noexcept { return count == 4; }
  [[nodiscard]] static double yaw(const Joints& q) noexcept { return q[3]; }

  [[nodiscard]] IkSolution place(const Vector3& p, double yaw_rad, std::uint32_t,
                                 const Joints& hint) const noexcept {
    IkSolution solution;
    solution.status = IkStatus::kOk;
    const Vector3 at_m = has_hand() ? hand_axis(mount, p, yaw_rad) : p - mount.hand.position_m;
    for (std::size_t i = 0; i < 3; ++i) solution.joints_q[i] = dot(at_m, measures[i]);
    if (has_hand()) solution.joints_q[3] = nearest_turn(yaw_rad, hint[3]);
    return solution;
  }
};

}  // namespace corbot
