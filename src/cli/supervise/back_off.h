// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace corbot::cli {

/// Delay before a process that has ended is restarted; it doubles each time.
class BackOff {
 public:
  static constexpr double kFirst_s = 0.1;  // a robot should not lack its servant for long
  static constexpr double kLongest_s = 5.0;

  /// `was_healthy`: the ended process had run long enough, so the delay begins anew.
  [[nodiscard]] double next_s(bool was_healthy) noexcept {
    last_s_ = was_healthy || last_s_ == 0 ? kFirst_s : std::min(2 * last_s_, kLongest_s);
    return last_s_;
  }

 private:
  double last_s_{0};
};

}  // namespace corbot::cli
