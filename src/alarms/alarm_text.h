// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "corbot/arm/joint_units.h"
#include "corbot/backend/device_cause.h"
#include "corbot/channel/records.h"

// The text of the real-time task's alarms: for the servant, and for the task's own log.

namespace corbot {

/// Such as "the line was cut"; "" for none.
[[nodiscard]] const char* device_cause_text(DeviceCause cause);

/// What has happened, with joint, value and limit where there are any. `kinds`: of the arm's joints.
[[nodiscard]] std::string alarm_text(const AlarmEvent& event, const JointKinds& kinds);

/// The robot goes into Error with it; the others are warnings.
[[nodiscard]] bool causes_error(AlarmCode code);

}  // namespace corbot
