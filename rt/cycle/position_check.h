// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "corbot/arm/joints.h"
#include "corbot/motion/bounds.h"

namespace corbot::rt {

/// Whether the arm's position is verified. It is not after a power-up of servos without encoders; a motion that has
/// gone somewhere and was not stopped verifies it, and is slow. Real-time safe.
class PositionCheck {
 public:
  /// A smaller rotation verifies nothing.
  static constexpr double kLeastMotion_rad = 0.01;

  /// `power_cut_at_stop`: an emergency stop cuts the servos' power.
  void begin(bool unverified, bool power_cut_at_stop) noexcept {
    unverified_ = unverified;
    power_cut_at_stop_ = power_cut_at_stop;
  }
  void set_unverified(bool unverified) noexcept { unverified_ = unverified; }
  void emergency_stop_cleared() noexcept { unverified_ = unverified_ || power_cut_at_stop_; }
  void motion_done(const Joints& from_rad, const Joints& to_rad) noexcept {
    for (std::size_t i = 0; unverified_ && i < kMaxJoints; ++i) {
      unverified_ = std::abs(to_rad[i] - from_rad[i]) < kLeastMotion_rad;
    }
  }
  [[nodiscard]] bool is_unverified() const noexcept { return unverified_; }
  [[nodiscard]] double limit_override(double ratio) const noexcept {
    return unverified_ ? std::min(ratio, kFirstMotionOverride) : ratio;
  }

 private:
  bool unverified_{false};
  bool power_cut_at_stop_{false};
};

}  // namespace corbot::rt
