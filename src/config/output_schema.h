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

/// `[emergency_stop]`, `[power_enable]` and `[watchdog]`.
void read_emergency_stop(Section section, EmergencyStopOptions& options);
/// After profile.stop.
void read_power_enable(Section section, Profile& profile);
/// After the other tables that name GPIO lines, and `[loop]`.
void read_watchdog(Section section, Profile& profile);

/// `at_end`, the same for every kind that has it: whether it is "relax", not "hold".
[[nodiscard]] bool read_at_end(Section& section);

/// `stagger_ms`, likewise.
[[nodiscard]] int read_stagger(Section& section);

/// `readback`, `at_end` and `stagger_ms`.
[[nodiscard]] CommonBackendOptions read_common(Section& section, bool default_readback);

/// A key that is "high" or "low".
[[nodiscard]] bool read_active_low(Section& section, std::string_view key, bool fallback);

}  // namespace corbot
