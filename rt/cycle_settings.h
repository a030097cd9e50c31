// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/profile.h"
#include "rt/cycle/cycle.h"

namespace corbot::rt {

/// What the cycle is told of `[loop]`, `[stop]` and the joints. Set-up only.
[[nodiscard]] CycleSettings cycle_settings(const Profile& profile);

}  // namespace corbot::rt
