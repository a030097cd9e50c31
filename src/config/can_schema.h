// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "config/driven_joint.h"
#include "config/section.h"

namespace corbot {

/// Reads `[backend.socketcan]`; `joints`: one for each drive, empty if they are not known.
void read_socketcan(Section section, std::span<const DrivenJoint> joints, SocketCanOptions& options,
                    CommonBackendOptions& common);

}  // namespace corbot
