// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// Makes the backend that a profile names. Set-up only. Throws std::runtime_error for an unknown name,
/// listing the known ones. `stop` gets the state of the device's emergency stop input, if there is one, and
/// outlives the backend.
[[nodiscard]] std::unique_ptr<Backend> make_backend(const Profile& profile, EmergencyStop& stop);

/// Returns the text for --help on Backend::install_fault_controls(), of any backend.
[[nodiscard]] const char* fault_controls_help() noexcept;

}  // namespace corbot::rt
