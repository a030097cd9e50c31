// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/set_point_check.h"

#include <cmath>

#include "corbot/channel/alarms.h"

namespace corbot::rt {
namespace {

/// Of the speed limit: the plan may touch it exactly, and then differs by rounding.
constexpr double kSpeedTolerance = 1e-6;
constexpr double kStepTolerance_rad = 1e-7;  // rounding of the inverse next to a stretched arm
constexpr double kOpeningTolerance = 1e-9;

SetPointVerdict refused(const AlarmEvent& alarm) noexcept { return {false, alarm}; }

SetPointVerdict check_joint(const JointLimits& limits, std::int32_t joint, double last_rad, double next_rad,
                            double dt_s) noexcept {
  if (!std::isfinite(next_rad)) {
    return refused(alarm::set_point_not_finite(joint));
  }
  if (next_rad < limits.lower_rad - kGateTolerance_rad || next_rad > limits.upper_rad + kGateTolerance_rad) {
    return refused(alarm::set_point_out_of_range({.joint = joint,
                                                  .position_rad = next_rad,
                                                  .lower_rad = limits.lower_rad,
                                                  .upper_rad = limits.upper_rad}));
  }
  const double allowed_rad = limits.speed_rad_s * dt_s * (1.0 + kSpeedTolerance) + kStepTolerance_rad;
  const double step_rad = next_rad - last_rad;
  if (!(std::abs(step_rad) <= allowed_rad)) {
    return refused(
        alarm::set_point_discontinuous({.joint = joint, .step_rad = step_rad, .allowed_rad = allowed_rad}));
  }
  return {};
}

}  // namespace

SetPointVerdict check_set_point(const ArmModel& arm, const Joints& last_rad, const Joints& next_rad,
                                double opening, double dt_s) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    // Joints that the arm does not have stay at 0.
    const JointLimits limits = i < arm.dof ? arm.joints[i] : JointLimits{};
    const SetPointVerdict verdict =
        check_joint(limits, static_cast<std::int32_t>(i), last_rad[i], next_rad[i], dt_s);
    if (!verdict.ok) return verdict;
  }
  if (!std::isfinite(opening)) return refused(alarm::set_point_not_finite(-1));
  if (opening < -kOpeningTolerance || opening > 1.0 + kOpeningTolerance) {
    return refused(alarm::set_point_out_of_range(
        {.joint = -1, .position_rad = opening, .lower_rad = 0.0, .upper_rad = 1.0}));
  }
  return {};
}

std::optional<alarm::OutOfRange> beyond_range(const ArmModel& arm, const Joints& position_rad,
                                              double near_rad) noexcept {
  for (std::size_t i = 0; i < arm.dof && i < kMaxJoints; ++i) {
    const JointLimits& limits = arm.joints[i];
    const double at_rad = position_rad[i];
    if (at_rad >= limits.lower_rad - near_rad && at_rad <= limits.upper_rad + near_rad) continue;
    return alarm::OutOfRange{static_cast<std::int32_t>(i), at_rad, limits.lower_rad, limits.upper_rad};
  }
  return std::nullopt;
}

bool is_in_range(const ArmModel& arm, const Joints& position_rad, double tolerance_rad) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double lower_rad = i < arm.dof ? arm.joints[i].lower_rad : 0.0;
    const double upper_rad = i < arm.dof ? arm.joints[i].upper_rad : 0.0;
    if (!std::isfinite(position_rad[i])) return false;
    if (position_rad[i] < lower_rad - tolerance_rad || position_rad[i] > upper_rad + tolerance_rad)
      return false;
  }
  return true;
}

}  // namespace corbot::rt
