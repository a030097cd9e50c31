// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/section.h"
#include "corbot/arm/arm_model.h"

namespace corbot {

/// Reads `[workspace]`. To be called after the geometry, as an arm must have the parts that a shape names.
void read_workspace(Section section, ArmModel& arm);

}  // namespace corbot
