// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "corbot/channel/records.h"

// The alarms of the real-time task in words: the servant's, and its own log's.

namespace corbot {

/// DeviceCause of rt/backends/serial_port.h in words; "" for none.
[[nodiscard]] const char* device_cause_text(std::uint32_t cause);

/// What has happened, with joint, value and limit where there are any.
[[nodiscard]] std::string alarm_text(const AlarmEvent& event);

/// The robot goes into Error with it; the others are warnings.
[[nodiscard]] bool causes_error(AlarmCode code);

}  // namespace corbot
