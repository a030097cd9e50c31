// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "robot/corbot_robot.h"

namespace corbot::omni {

/// Any failure as the exception that the interface names for it.
[[noreturn]] void raise(const corbot_error& error);

/// Calls a function of corbot_robot.h, the error argument added, and raises what it refuses.
template <class Function, class... Arguments>
void call(Function function, Arguments&&... arguments) {
  corbot_error error{};
  if (function(std::forward<Arguments>(arguments)..., &error) != CORBOT_OK) raise(error);
}

}  // namespace corbot::omni
