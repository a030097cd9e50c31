// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/section.h"

namespace corbot {

/// `[backend]` and the table of the kind that it names.
void read_backend(Section section, BackendOptions& backend);

}  // namespace corbot
