// SPDX-License-Identifier: Apache-2.0
#pragma once

// Words of a refusal that clients of ours look for, as idl/robot.idl has them: servant and client take them from here.

namespace corbot {

/// These are values of LimitExceeded::quantity.
inline constexpr const char* kSpeedWord = "speed";
inline constexpr const char* kDurationWord = "duration";
/// Unreachable::reason has this where a point is beyond the arm's reach; the exception has no other mark of it.
inline constexpr const char* kTooFarWords = "too far";

}  // namespace corbot
