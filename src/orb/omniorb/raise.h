// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "robot/corbot_robot.h"

namespace corbot::omni {

/// Raises any failure as its exception of the interface.
[[noreturn]] void raise(const corbot_error& error);

/// Calls a function of corbot_robot.h with an error argument added, and raises its failure.
template <class Function, class... Arguments>
void call(Function function, Arguments&&... arguments) {
  corbot_error error{};
  if (function(std::forward<Arguments>(arguments)..., &error) != CORBOT_OK) raise(error);
}

}  // namespace corbot::omni
