// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "cli/supervise/state_lock.h"
#include "config/profile.h"
#include "state/last_position.h"

namespace corbot::cli {

/// For a command that drives the servos of a robot itself: keeps 'corbot up' out as long as the lock is held. Throws Failure
/// while the robot is up, or its real-time task runs.
[[nodiscard]] StateLock claim_servos(const std::string& name);

/// Where corbot left a robot that is down; nothing: no usable position is stored. Throws Failure while a hold is in force:
/// nothing may move then, whichever program would move it. `state_directory` empty: the default one.
[[nodiscard]] std::optional<LastPosition> position_unless_held(const Profile& profile,
                                                               const std::string& name,
                                                               const std::string& state_directory);

}  // namespace corbot::cli
