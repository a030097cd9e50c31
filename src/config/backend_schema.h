// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "config/section.h"

namespace corbot {

/// `[backend]` and the table of the kind that it names; `joints`: how many the arm
/// has, 0 where that is not known.
void read_backend(Section section, std::size_t joints, BackendOptions& backend);

}  // namespace corbot
