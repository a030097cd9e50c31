// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/supervise/up_options.h"

namespace corbot::cli {

/// Runs a robot in the foreground until a signal; see corbot(1). Throws Failure.
void up(const UpOptions& options);

/// Ends the supervisor of a robot and waits for its end; removes the stale files of a dead one. The robot is
/// `wanted`, else `robot` (the value of --robot), $CORBOT_ROBOT, or the only one. Throws Failure.
void down(const std::string& wanted, const std::string& robot);

}  // namespace corbot::cli
