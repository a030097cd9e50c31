// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/profile.h"
#include "config/section.h"

namespace corbot {

/// Reads every table of a profile into `profile` and reports faults. `profile` is valid only if there was no
/// fault.
void read_schema(const toml::table& root, Profile& profile, FaultList& faults);

}  // namespace corbot
