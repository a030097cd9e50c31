// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <type_traits>

#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/pose.h"

// The frames of planning: the arm's place, and the tool that it carries. Real-time safe.

namespace corbot {

/// The greatest distances along an axis: of the base from the origin of given positions, and of the tool from
/// the flange. A greater distance counts as a mistake of unit.
inline constexpr double kFarthestBase_m = 100.0;
inline constexpr double kFarthestTool_m = 10.0;
/// The tolerance of the squared length of a quaternion that is kept or handed over: it was made of unit
/// length before.
inline constexpr double kUnitTolerance = 1e-9;

/// base_T_tool = base_T_0 · motion of the joints · n_T_tool.
struct Frames {
  Pose base_T_0;  ///< the beginning of the arm's table, in the frame of given positions
  Pose n_T_tool;  ///< from the flange to the tool centre point
};
static_assert(std::is_trivially_copyable_v<Frames>);

[[nodiscard]] inline Frames frames_of(const Kinematics& arm) noexcept {
  return {arm.chain().base_T_0, arm.chain().n_T_tool};
}

/// Tells whether a frame is finite, of unit length, and no further than this along each axis.
[[nodiscard]] inline bool is_frame(const Pose& frame, double farthest_m) noexcept {
  for (const double x : frame.position_m) {
    if (!(std::abs(x) <= farthest_m)) return false;
  }
  return std::abs(squared_norm(frame.orientation) - 1.0) <= kUnitTolerance;
}
[[nodiscard]] inline bool are_frames(const Frames& frames) noexcept {
  return is_frame(frames.base_T_0, kFarthestBase_m) && is_frame(frames.n_T_tool, kFarthestTool_m);
}

}  // namespace corbot
