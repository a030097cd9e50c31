// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// The Error state, from a fault or a StopAndHold until a Clear. It decides how the arm comes to rest, and
/// when the servos are de-energised. Stop categories are those of IEC 60204-1. Real-time safe.
class FaultStop {
 public:
  enum class Way {
    kOnPath,   ///< slow down on the path, then de-energise (category 1)
    kByJoint,  ///< the same without a trusted path: each joint by itself
    kAtOnce,   ///< the servos may not follow any more: hold, de-energise (category 0)
    kHeld,     ///< by StopAndHold: at rest already, the energy stays (category 2)
  };

  /// `category`: of `[stop]`; 0: powered joints are not slowed down, but de-energised at once.
  explicit FaultStop(int category) noexcept : has_ramp_(category != 0) {}

  /// Begins a fault. `is_moving`: set-points are moving. If several faults meet, the one that leaves the
  /// least motion wins.
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
  /// Records that the set-points have come to rest.
  void come_to_rest() noexcept { ramp_ = Ramp::kNone; }
  /// Ends the Error, by a Clear.
  void release() noexcept { is_latched_ = takes_energy_ = false; }

  /// The robot is in Error.
  [[nodiscard]] bool is_latched() const noexcept { return is_latched_; }
  [[nodiscard]] bool is_slowing_down() const noexcept { return ramp_ != Ramp::kNone; }
  [[nodiscard]] bool is_by_joint() const noexcept { return ramp_ == Ramp::kByJoint; }
  /// True while slowing down towards power-off, and when power is off.
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
