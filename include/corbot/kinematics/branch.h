// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// The four closed-form solutions for a position and a tool pitch. Bit 0: sign of θ2. Bit 1: which way
/// the base faces. The names say the sign of θ2, not 'elbow up': θ2 > 0 is the upper elbow only while the wrist
/// is in front of the shoulder (u > 0), and with the wrist behind it the same sign is the lower elbow.
enum class Branch : std::uint32_t {
  kForwardPositive = 0,   ///< base faces the point, θ2 ≥ 0
  kForwardNegative = 1,   ///< base faces the point, θ2 ≤ 0
  kBackwardPositive = 2,  ///< base faces away (θ0 + π), arm folded over, θ2 ≥ 0
  kBackwardNegative = 3,  ///< base faces away (θ0 + π), arm folded over, θ2 ≤ 0
};
inline constexpr std::uint32_t kBranchCount = 4;

}  // namespace corbot
