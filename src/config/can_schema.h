// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "config/section.h"

namespace corbot {

/// `[backend.socketcan]`; `joints`: how many drives there must be, 0 where that is not known.
void read_socketcan(Section section, std::size_t joints, SocketCanOptions& options,
                    CommonBackendOptions& common);

}  // namespace corbot
