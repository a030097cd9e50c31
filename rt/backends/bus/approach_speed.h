// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "corbot/arm/arm_model.h"

namespace corbot::rt {

/// The speed of an approach, by the device or by the backend: a fifth of a servo's capability.
inline constexpr double kApproach_us_per_s = 400.0;
/// The acceleration of a gripper on the way: it reaches the approach speed after a tenth of a second.
inline constexpr double kGripper_us_per_s2 = 4000.0;

/// The limits of one coordinate of an approach, in us, or in rad or m. An acceleration of 0 is unknown: the
/// speed changes at once.
struct ApproachLimits {
  double speed{};
  double acceleration{};
};

/// Returns the limits of a servo's pulse, in the order of a frame.
[[nodiscard]] inline ApproachLimits pulse_limits(const ArmModel& arm, std::size_t servo) noexcept {
  if (servo >= arm.dof) return {kApproach_us_per_s, kGripper_us_per_s2};
  return {kApproach_us_per_s, arm.joints[servo].acceleration_q_s2 * arm.servos[servo].us_per_q};
}

/// One coordinate of an approach: its speed rises and falls within its limits. Real-time safe.
class ApproachRamp {
 public:
  /// Moves `value` towards `target` for `dt_s`; true when it rests there.
  bool step(double& value, double target, const ApproachLimits& limits, double dt_s) noexcept {
    const double way = target - value;
    const double least =
        std::min(std::abs(way) / dt_s, std::min(limits.speed, brakes_from(std::abs(way), limits, dt_s)));
    move(value, std::copysign(least, way), limits, dt_s);
    const bool is_there = std::abs(target - value) <= kAlike && std::abs(velocity_) <= change(limits, dt_s);
    if (is_there) rest_at(value, target);
    return is_there;
  }
  /// Slows down; true when it rests.
  bool halt(double& value, const ApproachLimits& limits, double dt_s) noexcept {
    if (velocity_ != 0.0) move(value, 0.0, limits, dt_s);
    return velocity_ == 0.0;
  }
  [[nodiscard]] bool rests() const noexcept { return velocity_ == 0.0; }

 private:
  static constexpr double kAlike = 1e-9;

  static double change(const ApproachLimits& limits, double dt_s) noexcept {
    return limits.acceleration > 0.0 ? limits.acceleration * dt_s : std::numeric_limits<double>::infinity();
  }
  /// Returns the speed from which it still comes to rest within `way`, in steps.
  static double brakes_from(double way, const ApproachLimits& limits, double dt_s) noexcept {
    if (!(limits.acceleration > 0.0)) return std::numeric_limits<double>::infinity();
    const double half = 0.5 * limits.acceleration * dt_s;
    return std::sqrt(2.0 * limits.acceleration * way + half * half) - half;
  }
  void move(double& value, double wanted, const ApproachLimits& limits, double dt_s) noexcept {
    const double most = change(limits, dt_s);
    velocity_ = std::clamp(wanted, velocity_ - most, velocity_ + most);
    value += velocity_ * dt_s;
  }
  void rest_at(double& value, double target) noexcept {
    value = target;
    velocity_ = 0.0;
  }

  double velocity_{0.0};
};

}  // namespace corbot::rt
