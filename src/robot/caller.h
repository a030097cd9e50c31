// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "robot/corbot_robot.h"
#include "robot/wanted.h"

namespace corbot {

// What a corbot_caller says; it may be null.

[[nodiscard]] std::string key_of(const corbot_caller* caller);
[[nodiscard]] std::string from_of(const corbot_caller* caller);
[[nodiscard]] corbot_counted_stop counted_of(const corbot_caller* caller);
[[nodiscard]] bool is_present(const corbot_caller* caller);

/// Of a call that starts a motion, while it is not started.
[[nodiscard]] Wanted wanted_to_start(const corbot_caller* caller);
/// Of a call that changes something. `otherwise`: what becomes of that when the call ends early, for its caller.
[[nodiscard]] Wanted wanted_to_change(const corbot_caller* caller,
                                      std::string otherwise = "what it asked for may still be carried out");

}  // namespace corbot
