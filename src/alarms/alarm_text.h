// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "corbot/arm/joint_units.h"
#include "corbot/backend/device_cause.h"
#include "corbot/channel/records.h"

// The text of the real-time task's alarms, for the servant and for the task's own log.

namespace corbot {

/// Returns text such as "the line was cut", or "" for no cause.
[[nodiscard]] const char* device_cause_text(DeviceCause cause);

/// Describes the event with joint, value and limit, if it has any. `kinds`: of the arm's joints. `shapes`:
/// the names of the profile's planes and boxes. The text counts those of clients behind them, as clients may
/// have changed them since.
[[nodiscard]] std::string alarm_text(const AlarmEvent& event, const JointKinds& kinds,
                                     std::span<const std::string> shapes = {});

/// Returns true if the alarm puts the robot into Error; other alarms are warnings.
[[nodiscard]] bool causes_error(AlarmCode code);

}  // namespace corbot
