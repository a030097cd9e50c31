// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"

namespace corbot::rt {

/// Limits the step after a stall: moves `next` as near to the last frame as the time between the two
/// requires. The speed is at most twice the profile's speed, hardly more than that speed in Error. The time
/// counts as `period_s` at least and as `longest_s` at most. Returns true if `next` is unchanged.
bool limit_step(const ArmModel& arm, const ServoFrame& last, double period_s, double longest_s,
                ServoFrame& next);

}  // namespace corbot::rt
