// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path.h"

// The joints at a point of a line or an arc. Planner, proof, gate and cycle all compute them by these
// functions. Real-time safe.

namespace corbot {

/// Returns the middle of the turn of a rotary joint within which a path stays. If the range is no wider than
/// a turn, it is the range's middle. For a wider range the turn is as near to the path's beginning as the
/// range allows.
[[nodiscard]] inline double middle_of_turn(const JointLimits& limits, double start_q) noexcept {
  constexpr double kHalfTurn = std::numbers::pi;
  if (limits.upper_q - limits.lower_q <= 2.0 * kHalfTurn) return 0.5 * (limits.lower_q + limits.upper_q);
  return std::clamp(start_q, limits.lower_q + kHalfTurn, limits.upper_q - kHalfTurn);
}

/// Returns the tool's deviation from a point of a path at these joints: the greatest of position (m) and
/// orientation, or followed angles (rad).
[[nodiscard]] inline double tool_deviation(const Kinematics& arm, const Joints& q,
                                           const PathPoint& point) noexcept {
  const Pose there = arm.forward(q);
  double off = norm(there.position_m - point.position_m);
  if (arm.follows() == Follows::kFull)
    return std::max(off, angle_between(there.orientation, point.orientation));
  const FollowedAngles followed = arm.followed();
  const Angles angles_rad = followed.at(q);
  for (std::size_t k = 0; k < followed.count; ++k)
    off = std::max(off, std::abs(wrap_angle(angles_rad[k] - point.angles_rad[k])));
  return off;
}

/// Returns the joints at a point of a path, on one solution, each at its turn next to the hint.
[[nodiscard]] inline IkSolution inverse_at(const Kinematics& arm, const PathPoint& point,
                                           std::uint32_t solution, const Joints& hint) noexcept {
  return arm.follows() == Follows::kFull ? arm.inverse({point.position_m, point.orientation}, solution, hint)
                                         : arm.inverse_at(point.position_m, point.angles_rad, solution, hint);
}

/// Returns the joints at a point of a path. `start_q`: the joints at the path's beginning; a joint that is
/// free at this point keeps its value.
[[nodiscard]] inline IkSolution joints_at(const ArmModel& arm, const PathPoint& point, std::uint32_t solution,
                                          const Joints& start_q) noexcept {
  IkSolution ik = inverse_at(arm.kinematics, point, solution, start_q);
  if (ik.status != IkStatus::kOk) return ik;
  for (std::size_t i = 0; i < arm.kinematics.joint_count(); ++i) {
    if (arm.kinematics.joint_kind(i) != JointKind::kRotary) continue;
    ik.joints_q[i] = nearest_turn(ik.joints_q[i], middle_of_turn(arm.joints[i], start_q[i]));
  }
  return ik;
}

}  // namespace corbot
