// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace corbot::cell {

/// Returns seconds since the Unix epoch, the unit of all times of the interface.
[[nodiscard]] inline double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace corbot::cell
