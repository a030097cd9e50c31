// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/servo_map.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {

double joint_pulse_us(const ServoMap& servo, double position_q, double last_us) noexcept {
  const double pulse_us = servo.zero_us + servo.direction * servo.us_per_q * position_q;
  if (std::isnan(pulse_us)) return last_us;
  return std::clamp(pulse_us, servo.pulse_min_us, servo.pulse_max_us);
}

double gripper_pulse_us(const GripperModel& gripper, double opening, double last_us) noexcept {
  if (std::isnan(opening)) return last_us;
  const double bounded = std::clamp(opening, 0.0, 1.0);
  return gripper.closed_us + (gripper.open_us - gripper.closed_us) * bounded;
}

void map_to_pulses(const ArmModel& arm, const Joints& position_q, double opening,
                   ServoFrame& frame) noexcept {
  const std::size_t dof = std::min<std::size_t>(arm.dof, kMaxJoints);
  for (std::size_t i = 0; i < dof; ++i) {
    frame.pulse_us[i] = joint_pulse_us(arm.servos[i], position_q[i], frame.pulse_us[i]);
    frame.channel[i] = arm.servos[i].channel;
  }
  frame.pulse_us[dof] = gripper_pulse_us(arm.gripper, opening, frame.pulse_us[dof]);
  frame.channel[dof] = arm.gripper.channel;
  frame.servo_count = static_cast<std::uint32_t>(dof + 1);
  frame.position_q = position_q;
}

}  // namespace corbot::rt
