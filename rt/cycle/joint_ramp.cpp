// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/joint_ramp.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

/// Speed-up in the search for a ramp that stays in range: that of the second try, doubled from try to try. A
/// faster ramp brakes harder by the square of it.
constexpr double kLeastFaster = 1e-5;
constexpr int kTries = 22;
constexpr double kRangeRounding_q = 1e-9;

/// Corrects the acceleration. The difference quotients of set-points are half a period, and a period, older
/// than the set-point. The first step of the ramp may make up for half a period of jerk, and no more. Without
/// it, a joint at the end of its acceleration would become faster than planned.
double acceleration_now(double velocity, double acceleration, const JointLimits& limits,
                        double period_s) noexcept {
  const double sign = when_even(velocity, acceleration, limits.jerk_q_s3) < 0.0 ? -1.0 : 1.0;
  const double now = acceleration - sign * limits.jerk_q_s3 * period_s / 2.0;
  const bool is_braking_enough = sign * when_even(velocity, now, limits.jerk_q_s3) <= 0.0;
  return is_braking_enough || sign * now < -limits.acceleration_q_s2 ? acceleration : now;
}

}  // namespace

JointRamp::JointRamp(const ArmModel& arm) noexcept
    : dof_(std::min<std::size_t>(arm.dof, kMaxJoints)),
      limits_(arm.joints),
      period_s_(static_cast<double>(arm.period_ns) * 1e-9) {}

void JointRamp::see(const Joints& position_q) noexcept {
  for (std::size_t i = 0; i < dof_; ++i) {
    const double velocity = (position_q[i] - position_q_[i]) / period_s_;
    acceleration_q_s2_[i] = (velocity - velocity_q_s_[i]) / period_s_;
    velocity_q_s_[i] = velocity;
  }
  position_q_ = position_q;
}

void JointRamp::rest_at(const Joints& position_q) noexcept {
  position_q_ = position_q;
  velocity_q_s_ = {};
  acceleration_q_s2_ = {};
}

/// Begins the ramps. Sampled once a cycle, a law's velocity gives differences that are means of its
/// acceleration and its jerk. So they keep the law's limits.
void JointRamp::begin() noexcept {
  elapsed_s_ = 0.0;
  duration_s_ = 0.0;
  for (std::size_t i = 0; i < dof_; ++i) {
    laws_[i] = law_within_range(i);
    duration_s_ = std::max(duration_s_, laws_[i].duration_s());
  }
}

StopLaw JointRamp::law_within_range(std::size_t joint) const noexcept {
  const JointLimits& limits = limits_[joint];
  const double lower_q = limits.lower_q - kRangeRounding_q;
  const double upper_q = limits.upper_q + kRangeRounding_q;
  StopLaw law;
  const double velocity = velocity_q_s_[joint];
  const double acceleration = acceleration_now(velocity, acceleration_q_s2_[joint], limits, period_s_);
  double more = kLeastFaster;
  for (int i = 0; i < kTries; ++i, more *= 2.0) {
    const double faster = i == 0 ? 1.0 : 1.0 + more;
    law = StopLaw(velocity, acceleration, limits.acceleration_q_s2 * faster * faster,
                  limits.jerk_q_s3 * faster * faster * faster);
    const double end_q = position_q_[joint] + law.distance(period_s_);
    if (end_q >= lower_q && end_q <= upper_q) break;
  }
  return law;
}

Joints JointRamp::next() noexcept {
  elapsed_s_ += period_s_;
  Joints next_q = position_q_;
  for (std::size_t i = 0; i < dof_; ++i) {
    const double step_q = laws_[i].velocity(elapsed_s_) * period_s_;
    // A joint that is beyond its end by rounding stays there.
    const double lower_q = std::min(limits_[i].lower_q, position_q_[i]);
    const double upper_q = std::max(limits_[i].upper_q, position_q_[i]);
    next_q[i] = std::clamp(position_q_[i] + step_q, lower_q, upper_q);
  }
  return next_q;
}

}  // namespace corbot::rt
