// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "config/driven_joint.h"
#include "config/section.h"

namespace corbot {

/// Reads `[backend]` and the table of its kind. `joints`: the arm's, empty if they are not known.
void read_backend(Section section, std::span<const DrivenJoint> joints, BackendOptions& backend);

}  // namespace corbot
