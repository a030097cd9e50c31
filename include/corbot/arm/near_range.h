// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/joint_units.h"

namespace corbot {

/// Of a joint that turns; near_q() says what that is for one that slides. A joint that is so little beyond its end is taken to be there, and brought there slowly: where encoders measure it,
/// and where a controller says what it sends, in steps of 10 us. The cycle, a start and the approach judge by it.
inline constexpr double kNearRangeMeasured_rad = to_radians(1.0);
inline constexpr double kNearRangeCommanded_rad = to_radians(2.0);

}  // namespace corbot
