// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/profile.h"
#include "rt/backends/can/drive_settings.h"

namespace corbot::rt {

/// Returns the drives' settings from `[backend.socketcan]` of a profile.
[[nodiscard]] Cia402Settings cia402_settings(const Profile& profile);

}  // namespace corbot::rt
