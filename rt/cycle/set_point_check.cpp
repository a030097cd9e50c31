// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/set_point_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "corbot/channel/alarms.h"

namespace corbot::rt {
namespace {

/// Tolerance of the speed limit: the plan may touch it exactly, and then differs by rounding.
constexpr double kSpeedTolerance = 1e-6;
constexpr double kStepTolerance_q = 1e-7;  // rounding of the inverse next to a stretched arm
constexpr double kOpeningTolerance = 1e-9;

SetPointVerdict refused(const AlarmEvent& alarm) noexcept { return {false, alarm}; }

SetPointVerdict check_joint(const JointLimits& limits, std::int32_t joint, double last_q, double next_q,
                            double dt_s) noexcept {
  if (!std::isfinite(next_q)) {
    return refused(alarm::set_point_not_finite(joint));
  }
  if (next_q < limits.lower_q - kGateTolerance_q || next_q > limits.upper_q + kGateTolerance_q) {
    return refused(alarm::set_point_out_of_range(
        {.joint = joint, .position_q = next_q, .lower_q = limits.lower_q, .upper_q = limits.upper_q}));
  }
  const double allowed_q = limits.speed_q_s * dt_s * (1.0 + kSpeedTolerance) + kStepTolerance_q;
  const double step_q = next_q - last_q;
  if (!(std::abs(step_q) <= allowed_q)) {
    return refused(
        alarm::set_point_discontinuous({.joint = joint, .step_q = step_q, .allowed_q = allowed_q}));
  }
  return {};
}

}  // namespace

SetPointVerdict check_set_point(const ArmModel& arm, const Joints& last_q, const Joints& next_q,
                                double opening, double dt_s) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    // Joints that the arm does not have stay at 0.
    const JointLimits limits = i < arm.dof ? arm.joints[i] : JointLimits{};
    const SetPointVerdict verdict =
        check_joint(limits, static_cast<std::int32_t>(i), last_q[i], next_q[i], dt_s);
    if (!verdict.ok) return verdict;
  }
  if (!std::isfinite(opening)) return refused(alarm::set_point_not_finite(-1));
  if (opening < -kOpeningTolerance || opening > 1.0 + kOpeningTolerance) {
    return refused(
        alarm::set_point_out_of_range({.joint = -1, .position_q = opening, .lower_q = 0.0, .upper_q = 1.0}));
  }
  return {};
}

SetPointVerdict DifferenceCheck::see(const ArmModel& arm, const Joints& next_q, double period_s) noexcept {
  constexpr double kRounding_q = 2e-15;  // of a set-point up to 4; the n-th difference has 2^n times that
  for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i) {
    const double step_q = next_q[i] - last_q_[0][i], step_before_q = last_q_[0][i] - last_q_[1][i];
    const double bend_q = step_q - step_before_q;
    const double third_q = bend_q - (step_before_q - (last_q_[1][i] - last_q_[2][i]));
    const JointLimits& limits = arm.joints[i];
    double span = 1.0, rounding_q = kRounding_q;
    std::uint32_t order = 0;
    for (const auto& [difference_q, limit_q] : {std::pair{step_q, limits.speed_q_s},
                                                {bend_q, limits.acceleration_q_s2},
                                                {third_q, limits.jerk_q_s3}}) {
      ++order;
      span *= period_s;
      rounding_q *= 2.0;
      const double allowed_q = kAllowed * limit_q;
      if (std::abs(difference_q) <= allowed_q * span + rounding_q) continue;
      return refused(
          alarm::set_point_too_quick({static_cast<std::int32_t>(i), order, difference_q / span, allowed_q}));
    }
  }
  last_q_ = {next_q, last_q_[0], last_q_[1]};
  return {};
}

std::optional<alarm::OutOfRange> beyond_range(const ArmModel& arm, const Joints& position_q,
                                              double near_rad) noexcept {
  for (std::size_t i = 0; i < arm.dof && i < kMaxJoints; ++i) {
    const JointLimits& limits = arm.joints[i];
    const double at_q = position_q[i];
    const double near = near_q(arm.kinematics.joint_kind(i), near_rad);
    if (at_q >= limits.lower_q - near && at_q <= limits.upper_q + near) continue;
    return alarm::OutOfRange{static_cast<std::int32_t>(i), at_q, limits.lower_q, limits.upper_q};
  }
  return std::nullopt;
}

bool is_in_range(const ArmModel& arm, const Joints& position_q, double tolerance_q) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double lower_q = i < arm.dof ? arm.joints[i].lower_q : 0.0;
    const double upper_q = i < arm.dof ? arm.joints[i].upper_q : 0.0;
    if (!std::isfinite(position_q[i])) return false;
    if (position_q[i] < lower_q - tolerance_q || position_q[i] > upper_q + tolerance_q) return false;
  }
  return true;
}

}  // namespace corbot::rt
