// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "corbot/arm/joint_units.h"
#include "corbot/kinematics/joints.h"
#include "corbot/motion/bounds.h"

namespace corbot::rt {

/// Tracks whether the arm's position is verified. It is not after servos without encoders may have been
/// without energy. A motion that has gone somewhere and was not stopped verifies it, and is slow. Real-time
/// safe.
class PositionCheck {
 public:
  /// A smaller motion of a joint verifies nothing; near_q() of it for a sliding joint.
  static constexpr double kLeastMotion_rad = 0.01;

  explicit PositionCheck(const JointKinds& kinds = {}) noexcept : kinds_(kinds) {}

  /// `is_known`: the device, or the profile's author, knows the servos' positions after they were without
  /// energy.
  void begin(bool unverified, bool is_known) noexcept {
    unverified_ = unverified;
    is_known_ = is_known;
  }
  void set_unverified(bool unverified) noexcept { unverified_ = unverified; }
  /// Records that a Clear gives the energy back.
  void energy_returns(bool is_measured) noexcept { unverified_ = unverified_ || !(is_known_ || is_measured); }
  void motion_done(const Joints& from_q, const Joints& to_q) noexcept {
    for (std::size_t i = 0; unverified_ && i < kMaxJoints; ++i) {
      unverified_ = std::abs(to_q[i] - from_q[i]) < near_q(kinds_[i], kLeastMotion_rad);
    }
  }
  [[nodiscard]] bool is_unverified() const noexcept { return unverified_; }
  [[nodiscard]] double limit_override(double ratio) const noexcept {
    return unverified_ ? std::min(ratio, kFirstMotionOverride) : ratio;
  }

 private:
  JointKinds kinds_;
  bool unverified_{false};
  bool is_known_{false};
};

}  // namespace corbot::rt
