// SPDX-License-Identifier: Apache-2.0
#pragma once

// Every bound that planner and real-time task both know. The task's are never narrower than the planner's: a
// plan that the planner has proved must not be refused for a rounding.

namespace corbot {

/// The planner plans no motion, and no dwell, that lasts longer.
inline constexpr double kLongestPlan_s = 3600.0;
/// The task refuses a command that claims to last longer: far beyond any plan, it keeps what is computed from
/// a duration finite.
inline constexpr double kLongestCommand_s = 1e6;
static_assert(kLongestCommand_s >= kLongestPlan_s);

/// Coordinates beyond this, along each axis, are taken for a mistake of unit, not for a target.
inline constexpr double kFarthestCoordinate_m = 1000.0;

/// A command must begin where the arm rests, within this (rad or m, or part of the gripper's opening).
inline constexpr double kStartTolerance = 1e-6;
/// The planner refuses a line or an arc whose first point misses the arm's joints by more.
inline constexpr double kPlannedStartTolerance_q = kStartTolerance / 2.0;

/// A joint value from inverse kinematics may miss its range by this much: next to the stretched or the folded
/// arm half of the digits go, so that 1e-16 m of rounding becomes 1e-8 rad. 1e-7 rad is a thousandth of a
/// servo's step.
inline constexpr double kRangeTolerance_q = 1e-7;

/// Until the first motion from an unverified position is done, motions run at this rate at the most.
inline constexpr double kFirstMotionOverride = 0.1;

}  // namespace corbot
