// SPDX-License-Identifier: Apache-2.0
#pragma once

// The bounds that planner and real-time task share. The task's bounds are never narrower than the planner's:
// it must not refuse a proved plan because of rounding.

namespace corbot {

/// The longest motion, and the longest dwell, that the planner plans.
inline constexpr double kLongestPlan_s = 3600.0;
/// The task refuses a command with a longer duration. The bound is far beyond any plan, and keeps finite what
/// is computed from a duration.
inline constexpr double kLongestCommand_s = 1e6;
static_assert(kLongestCommand_s >= kLongestPlan_s);

/// Coordinates beyond this, along each axis, count as a mistake of unit.
inline constexpr double kFarthestCoordinate_m = 1000.0;

/// A command must begin at the arm's rest position, within this (rad or m, or part of the gripper's opening).
inline constexpr double kStartTolerance = 1e-6;
/// The planner refuses a line or an arc whose first point misses the arm's joints by more.
inline constexpr double kPlannedStartTolerance_q = kStartTolerance / 2.0;

/// A joint value from inverse kinematics may miss its range by this much. Next to the stretched or the folded
/// arm half of the digits are lost: 1e-16 m of rounding becomes 1e-8 rad. The tolerance of 1e-7 rad is a
/// thousandth of a servo's step.
inline constexpr double kRangeTolerance_q = 1e-7;

/// The greatest rate of motions until the first motion from an unverified position is done.
inline constexpr double kFirstMotionOverride = 0.1;

}  // namespace corbot
