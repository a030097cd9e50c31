// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/supervise/state_lock.h"

namespace corbot::cli {

/// For a command that drives the servos of a robot itself: keeps 'corbot up' out as long as the lock is held. Throws Failure
/// while the robot is up, or its real-time task runs.
[[nodiscard]] StateLock claim_servos(const std::string& name);

}  // namespace corbot::cli
