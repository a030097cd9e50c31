// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"

namespace corbot::rt {

/// After a stall: brings `next` as near to the last frame as the device may be asked to go in the time
/// between the two, at no more than twice the speed that the profile allows, hardly more than it in Error. That time counts as `period_s`
/// at least and as `longest_s` at most. True when `next` is the frame that it was.
bool limit_step(const ArmModel& arm, const ServoFrame& last, double period_s, double longest_s,
                ServoFrame& next);

}  // namespace corbot::rt
