// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/joint_units.h"

namespace corbot {

/// Tolerances beyond the end of a joint's range, for a turning joint; near_q() converts them for a sliding
/// one. A joint beyond its end by no more counts as at its end, and is moved there slowly. The first is for
/// joints that encoders measure. The second is for controllers that report the pulses they send, in steps of
/// 10 us. The cycle, a start and the approach use them.
inline constexpr double kNearRangeMeasured_rad = to_radians(1.0);
inline constexpr double kNearRangeCommanded_rad = to_radians(2.0);

}  // namespace corbot
