// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "rt/inputs/safety_lines.h"

namespace corbot::rt {

/// The backend that a profile names. Set-up only. Throws std::runtime_error for an unknown name, listing the
/// known. `stop` is told of the device's emergency stop input, where it has one, and outlives the backend.
[[nodiscard]] std::unique_ptr<Backend> make_backend(const Profile& profile, EmergencyStop& stop);

/// The GPIO lines of `[emergency_stop]` and `[power_enable]`, where there are any. Set-up only.
[[nodiscard]] SafetySettings safety_settings(const Profile& profile);

}  // namespace corbot::rt
