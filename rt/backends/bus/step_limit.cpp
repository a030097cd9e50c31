// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/step_limit.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

/// After a stall, the device catches up at this multiple of the profile's speed.
constexpr double kCatchUp = 2.0;
/// The multiple in Error, where nothing needs to catch up. It is above 1, so that rounding limits no step
/// without a stall.
constexpr double kCatchUpInError = 1.05;

/// Returns the share of a way that is allowed.
double share_of(double way, double most) {
  return most > 0.0 && std::abs(way) > most ? most / std::abs(way) : 1.0;
}

}  // namespace

bool limit_step(const ArmModel& arm, const ServoFrame& last, double period_s, double longest_s,
                ServoFrame& next) {
  if (last.servo_count != next.servo_count || next.servo_count <= arm.dof) return true;
  const double time_s =
      std::clamp(static_cast<double>(next.time_ns - last.time_ns) * 1e-9, period_s, longest_s);
  const double factor = next.needs_clear ? kCatchUpInError : kCatchUp;
  // All joints go the same share of their ways: the arm stays on its path, except for the chord.
  double share = 1.0;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const double way = next.position_q[i] - last.position_q[i];
    share = std::min(share, share_of(way, factor * arm.joints[i].speed_q_s * time_s));
  }
  if (share < 1.0) {
    for (std::size_t i = 0; i < arm.dof; ++i) {
      next.position_q[i] = std::lerp(last.position_q[i], next.position_q[i], share);
      next.pulse_us[i] = std::lerp(last.pulse_us[i], next.pulse_us[i], share);
    }
  }
  const GripperModel& gripper = arm.gripper;
  const double travel_us = std::abs(gripper.open_us - gripper.closed_us);
  const double most_us = gripper.travel_s > 0.0 ? factor * travel_us / gripper.travel_s * time_s : 0.0;
  const double way_us = next.pulse_us[arm.dof] - last.pulse_us[arm.dof];
  const double gripper_share = share_of(way_us, most_us);
  if (gripper_share < 1.0) next.pulse_us[arm.dof] = last.pulse_us[arm.dof] + gripper_share * way_us;
  return share >= 1.0 && gripper_share >= 1.0;
}

}  // namespace corbot::rt
