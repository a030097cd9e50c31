// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "config/driven_joint.h"
#include "config/section.h"

namespace corbot {

/// Returns true if a backend of this kind sends pulses, so that every joint must define its pulses. The
/// others take set-points of joints: drives by their own scale, the simulator by fitted servos. A kind that
/// corbot does not know counts as one of them, as its fault is enough.
[[nodiscard]] bool sends_pulses(std::string_view backend_kind);

/// Reads `[backend]` and the table of its kind. `joints`: the arm's, empty if they are not known.
void read_backend(Section section, std::span<const DrivenJoint> joints, BackendOptions& backend);

}  // namespace corbot
