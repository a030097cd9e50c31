// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace corbot::cell {

/// Seconds since the Unix epoch, as the interface has all times.
[[nodiscard]] inline double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace corbot::cell
