// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/profile.h"
#include "rt/cycle/cycle.h"

namespace corbot::rt {

/// Returns the cycle's settings from `[loop]`, `[stop]` and the joints of a profile. Set-up only.
[[nodiscard]] CycleSettings cycle_settings(const Profile& profile);

}  // namespace corbot::rt
