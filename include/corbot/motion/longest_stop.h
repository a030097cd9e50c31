// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_proof.h"

namespace corbot::rate {

/// The longest stop that longest_stop_s() searches.
inline constexpr double kLongestStop_s = 10.0;

/// Returns the longest time, s, that a stop along a path may take from any instant of its request. A motion
/// reaches all its limits at once and speeds up from rest, and the function tries a stop every 10 ms of it. A
/// state that is slower, or speeds up less, stops sooner. The result is above kLongestStop_s if there is a
/// longer stop. Not real-time safe: it takes about a millisecond.
[[nodiscard]] inline double longest_stop_s(const ArmModel& arm) noexcept {
  constexpr double kStep_s = 0.01;
  std::array<RateLimit, RateCurve::kMostLimits> limits{};
  std::size_t count = 0;
  for (; count < arm.dof; ++count) {
    const JointLimits& joint = arm.joints[count];
    limits[count] = {joint.speed_q_s, joint.acceleration_q_s2, joint.jerk_q_s3};
  }
  const PathLimits& path = arm.path;
  limits[count++] = {path.speed_m_s, path.acceleration_m_s2, path.jerk_m_s3};
  limits[count++] = {path.rotation_speed_rad_s, path.rotation_acceleration_rad_s2, path.rotation_jerk_rad_s3};
  const Shares all{1.0, 1.0 - kAccelerationReserve, 1.0 - kJerkReserve};
  const RateCurve curve(std::span(limits.data(), count), all);

  RateGovernor moving;
  moving.begin(curve, 0.0);
  moving.seek(1.0);
  double longest_s = 0.0;
  for (double now_s = 0.0; now_s < kLongestStop_s && longest_s < kLongestStop_s && moving.rate() < 1.0;
       now_s += kStep_s) {
    moving.advance(kStep_s);
    RateGovernor stopping = moving;
    stopping.seek(0.0);
    double stop_s = 0.0;
    for (; stop_s < kLongestStop_s && !stopping.is_at_rest(); stop_s += kStep_s) stopping.advance(kStep_s);
    longest_s = std::max(longest_s, stop_s);
  }
  // Covers the states between the instants.
  return longest_s + kStep_s;
}

}  // namespace corbot::rate
