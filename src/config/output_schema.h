// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "config/section.h"

namespace corbot {

/// `[backend.pca9685]`, `[backend.pwm_sysfs]` and `[backend.gpiod]`, those that are there. Whether
/// backend.kind names one of them.
bool read_outputs(Section& section, BackendOptions& backend);

/// The channels of the servos, each with its key, against those that the device has. `section`: [backend].
void check_channels(Section section, const BackendOptions& backend,
                    const std::map<std::uint32_t, std::string>& channels);

/// `[emergency_stop]` and `[power_enable]`.
void read_emergency_stop(Section section, EmergencyStopOptions& options);
void read_power_enable(Section section, PowerEnableOptions& options);

/// `at_end`, the same for every kind that has it: whether it is "relax", not "hold".
[[nodiscard]] bool read_at_end(Section& section);

/// `readback` and `at_end`.
[[nodiscard]] CommonBackendOptions read_common(Section& section, bool default_readback);

/// A key that is "high" or "low".
[[nodiscard]] bool read_active_low(Section& section, std::string_view key, bool fallback);

}  // namespace corbot
