// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "robot/corbot_robot.h"
#include "robot/wanted.h"

namespace corbot {

// Read the fields of a corbot_caller, which may be null.

[[nodiscard]] std::string key_of(const corbot_caller* caller);
[[nodiscard]] std::string from_of(const corbot_caller* caller);
[[nodiscard]] corbot_counted_stop counted_of(const corbot_caller* caller);
[[nodiscard]] bool is_present(const corbot_caller* caller);

/// Abort check of a call that starts a motion, until the motion starts.
[[nodiscard]] Wanted wanted_to_start(const corbot_caller* caller);
/// Abort check of a call that changes state. `otherwise` tells the client what happens if the call ends
/// early.
[[nodiscard]] Wanted wanted_to_change(const corbot_caller* caller,
                                      std::string otherwise = "the robot may still carry out the call");

}  // namespace corbot
