// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/supervise/up_options.h"

namespace corbot::cli {

/// In the foreground until a signal; see corbot(1). Throws Failure.
void up(const UpOptions& options);

/// Ends the supervisor of a robot and waits for its end; removes the stale files of a dead one. `name` may be
/// empty where one robot is up. Throws Failure.
void down(const std::string& name);

}  // namespace corbot::cli
