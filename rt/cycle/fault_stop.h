// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// Error, from a fault or a StopAndHold until a Clear: how it brings the arm to rest, and when it takes the servos'
/// energy off. Stop categories are those of IEC 60204-1. Real-time safe.
class FaultStop {
 public:
  enum class Way {
    kOnPath,   ///< slow down on the path, then take the energy off (category 1)
    kByJoint,  ///< the same where there is no path to be trusted: each joint by itself
    kAtOnce,  ///< the servos do not follow any more, or nobody knows since when: hold, take the energy off (category 0)
    kHeld,  ///< by StopAndHold: at rest already, the energy stays (category 2)
  };

  /// `category`: of `[stop]`; 0: what has energy is not slowed down, but loses it at once.
  explicit FaultStop(int category) noexcept : has_ramp_(category != 0) {}

  /// `is_moving`: set-points are on their way. Of several faults the one that leaves the least wins.
  void begin(Way way, bool is_moving) noexcept {
    is_latched_ = true;
    if (way == Way::kHeld) return;
    takes_energy_ = true;
    if (!is_moving || way == Way::kAtOnce || !has_ramp_) {
      ramp_ = Ramp::kNone;
    } else if (way == Way::kByJoint) {
      ramp_ = Ramp::kByJoint;
    } else if (ramp_ == Ramp::kNone) {
      ramp_ = Ramp::kOnPath;
    }
  }
  /// The set-points have come to rest.
  void come_to_rest() noexcept { ramp_ = Ramp::kNone; }
  /// By a Clear.
  void release() noexcept { is_latched_ = takes_energy_ = false; }

  /// The robot is in Error.
  [[nodiscard]] bool is_latched() const noexcept { return is_latched_; }
  [[nodiscard]] bool is_slowing_down() const noexcept { return ramp_ != Ramp::kNone; }
  [[nodiscard]] bool is_by_joint() const noexcept { return ramp_ == Ramp::kByJoint; }
  /// Slowing down, and without energy after that, or without it already.
  [[nodiscard]] bool takes_energy() const noexcept { return takes_energy_; }
  [[nodiscard]] bool power_off() const noexcept { return takes_energy_ && ramp_ == Ramp::kNone; }

 private:
  enum class Ramp : std::uint8_t { kNone, kOnPath, kByJoint };
  bool has_ramp_;
  bool is_latched_{false};
  bool takes_energy_{false};
  Ramp ramp_{Ramp::kNone};
};

}  // namespace corbot::rt
