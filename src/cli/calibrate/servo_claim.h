// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "cli/supervise/state_lock.h"
#include "config/profile.h"
#include "state/last_position.h"

namespace corbot::cli {

/// Claims the servos for a command that drives them itself. While the lock is held, 'corbot up' is refused.
/// Throws Failure while the robot is up, or its real-time task runs.
[[nodiscard]] StateLock claim_servos(const std::string& name);

/// Returns the last position of a robot that is down, or nothing if no usable position is stored. Throws
/// Failure while a hold is in force: nothing may move then, by any program. `state_directory` empty: the
/// default one.
[[nodiscard]] std::optional<LastPosition> position_unless_held(const Profile& profile,
                                                               const std::string& name,
                                                               const std::string& state_directory);

}  // namespace corbot::cli
