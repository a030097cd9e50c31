// SPDX-License-Identifier: Apache-2.0
#pragma once

// Words that corbot's clients look for in a refusal. Servant and client take them from here.

namespace corbot {

/// Values of LimitExceeded::quantity, which idl/robot.idl fixes.
inline constexpr const char* kSpeedWord = "speed";
inline constexpr const char* kDurationWord = "duration";
inline constexpr const char* kJointRangeWord = "joint range";
/// LimitExceeded::quantity of a motion that leaves the workspace begins so, and the reason follows.
inline constexpr const char* kWorkspaceWord = "workspace: ";
/// The text in Unreachable::reason if a point is beyond the arm's reach. The exception has no other mark of
/// this case.
inline constexpr const char* kTooFarWords = "too far";

}  // namespace corbot
