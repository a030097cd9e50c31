// SPDX-License-Identifier: Apache-2.0
#pragma once

// Clients of ours look for these words in a refusal. Servant and client take them from here.

namespace corbot {

/// These are values of LimitExceeded::quantity, which idl/robot.idl fixes.
inline constexpr const char* kSpeedWord = "speed";
inline constexpr const char* kDurationWord = "duration";
/// Unreachable::reason has this where a point is beyond the arm's reach; the exception has no other mark of it.
inline constexpr const char* kTooFarWords = "too far";

}  // namespace corbot
