// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "config/section.h"

namespace corbot {

/// Reads `[backend.pca9685]`, `[backend.pwm_sysfs]` and `[backend.gpiod]` if they exist. Returns true if
/// backend.kind names one of them.
bool read_outputs(Section& section, BackendOptions& backend);

/// Checks the channels of the servos, each with its key, against the device's channels. `section`: [backend].
void check_channels(Section section, const BackendOptions& backend,
                    const std::map<std::uint32_t, std::string>& channels);

/// Read `[emergency_stop]`, `[power_enable]` and `[watchdog]`.
void read_emergency_stop(Section section, EmergencyStopOptions& options);
/// To be called after profile.stop is read.
void read_power_enable(Section section, Profile& profile);
/// To be called after the other tables that name GPIO lines, and after `[loop]`.
void read_watchdog(Section section, Profile& profile);

/// Reads `at_end`, the same for every kind that has it. Returns true for "relax", false for "hold".
[[nodiscard]] bool read_at_end(Section& section);

/// Reads `stagger_ms`, the same for every kind that has it.
[[nodiscard]] int read_stagger(Section& section);

/// Reads `readback`, `at_end` and `stagger_ms`.
[[nodiscard]] CommonBackendOptions read_common(Section& section, bool default_readback);

/// Reads a key that is "high" or "low".
[[nodiscard]] bool read_active_low(Section& section, std::string_view key, bool fallback);

}  // namespace corbot
