// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/profile.h"
#include "rt/inputs/safety_lines.h"

namespace corbot::rt {

/// Returns the GPIO lines of `[emergency_stop]`, `[power_enable]` and `[watchdog]`, if the profile has them.
/// Set-up only.
[[nodiscard]] SafetySettings safety_settings(const Profile& profile);

}  // namespace corbot::rt
