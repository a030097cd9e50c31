// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "corbot/kinematics/angles.h"
#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"
#include "corbot/kinematics/sub_problems.h"

namespace corbot {

/// Returns the crossing of two axes; nullopt if they are parallel or pass each other.
[[nodiscard]] inline std::optional<Vector3> crossing(const JointAxis& a, const JointAxis& b) noexcept {
  const Vector3 n = cross(a.direction, b.direction);
  const double nn = dot(n, n);
  const Vector3 away = b.point_m - a.point_m;
  if (nn < kRecognised || std::abs(dot(away, n)) > kRecognised * std::sqrt(nn)) return std::nullopt;
  return a.point_m + (dot(cross(away, b.direction), n) / nn) * a.direction;
}

/// Joints 4 to 6 with axes through one point, each square to the next. They are a rotation W·Rz(q4)·Ry(q5 +
/// zero)·Rz(q6) about this point. Real-time safe.
struct SphericalWrist {
  Quaternion arm_R_wrist{};  ///< W: z along axis 4, y along axis 5, both at zero
  double middle_zero_rad{};  ///< angle from axis 4 to axis 6 at zero

  /// Returns W in frame 0 with all joints at zero, and the centre; nullopt if the last three axes are no such
  /// wrist.
  [[nodiscard]] static std::optional<Pose> zero_T_wrist(const JointChain& chain) noexcept {
    if (chain.count != 6) return std::nullopt;
    for (std::size_t i = 3; i < 6; ++i) {
      if (chain.axes[i].kind != JointKind::kRotary) return std::nullopt;
    }
    const JointAxis &a = chain.axes[3], &b = chain.axes[4], &c = chain.axes[5];
    if (!square(a.direction, b.direction) || !square(b.direction, c.direction)) return std::nullopt;
    const auto centre = crossing(a, b);
    const auto other = crossing(b, c);
    if (!centre || !other || norm(*centre - *other) > kRecognised) return std::nullopt;
    return Pose{*centre, from_columns(cross(b.direction, a.direction), b.direction, a.direction)};
  }
  /// Returns the wrist on an arm; `zero_T_arm` is the last frame before the wrist, at zero.
  [[nodiscard]] static SphericalWrist on(const JointChain& chain, const Pose& zero_T_arm,
                                         const Pose& zero_T_wrist) noexcept {
    const Vector3 last = rotate(conjugate(zero_T_wrist.orientation), chain.axes[5].direction);
    return {conjugate(zero_T_arm.orientation) * zero_T_wrist.orientation, std::atan2(last[0], last[2])};
  }

  /// Returns the rotation of the last frame, which at zero is W turned about y by middle_zero_rad.
  [[nodiscard]] Quaternion rotation(const Joints& q) const noexcept {
    const double sum = 0.5 * (q[3] + q[5]);
    const double difference = 0.5 * (q[3] - q[5]);
    const double middle = 0.5 * (q[4] + middle_zero_rad);
    const double c = std::cos(middle), s = std::sin(middle);
    return arm_R_wrist * Quaternion{c * std::cos(sum), -s * std::sin(difference), s * std::cos(difference),
                                    c * std::sin(sum)};
  }
  /// Computes joints 4 to 6 for this rotation, next to the hint.
  void solve(const Quaternion& arm_R_last, bool flipped, const Joints& hint, Joints& q) const noexcept {
    take(zyz(conjugate(arm_R_wrist) * arm_R_last, flipped, hint[3]), hint, q);
  }
  /// Computes solve() for both signs, and takes the rotation apart only once.
  void solve_both(const Quaternion& arm_R_last, const Joints& hint, Joints& q,
                  Joints& flipped_q) const noexcept {
    const Zyz t = zyz(conjugate(arm_R_wrist) * arm_R_last, false, hint[3]);
    take(t, hint, q);
    take(flipped(t), hint, flipped_q);
  }

 private:
  void take(const Zyz& t, const Joints& hint, Joints& q) const noexcept {
    q[3] = nearest_turn(t.first_rad, hint[3]);
    q[4] = nearest_turn(t.middle_rad - middle_zero_rad, hint[4]);
    q[5] = nearest_turn(t.last_rad, hint[5]);
  }
};

}  // namespace corbot
