// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// The result of inverse kinematics: joints found, or the reason why not.
enum class IkStatus : std::uint32_t {
  kOk,
  kTooFar,      ///< a distance inside the arm would have to exceed what its links allow (stretched arm)
  kTooClose,    ///< the distance would have to be smaller (folded arm, lateral offset from an axis)
  kNotFinite,   ///< an argument was NaN or infinite, or a quaternion zero
  kNoSolution,  ///< the arm has no solution of this number
};

}  // namespace corbot
