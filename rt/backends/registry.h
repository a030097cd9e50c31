// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// The backend that a profile names. Set-up only. Throws std::runtime_error for an unknown name, listing the
/// known. `stop` gets the state of the device's emergency stop input, where it has one,
/// and outlives the backend.
[[nodiscard]] std::unique_ptr<Backend> make_backend(const Profile& profile, EmergencyStop& stop);

/// For --help: what Backend::install_fault_controls() offers, of whichever backend.
[[nodiscard]] const char* fault_controls_help() noexcept;

}  // namespace corbot::rt
