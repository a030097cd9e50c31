// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/bus_reading.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

bool are_pulses(const BusReading& reading, std::size_t servos) {
  return reading.unit == BusReading::Unit::kPulses &&
         std::all_of(reading.value.begin(), reading.value.begin() + static_cast<std::ptrdiff_t>(servos),
                     is_pulse);
}

Joints joints_of(const ArmModel& arm, const BusReading& reading) {
  Joints position_q{};
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const ServoMap& map = arm.servos[i];
    position_q[i] = reading.unit == BusReading::Unit::kJoints
                        ? reading.value[i]
                        : (reading.value[i] - map.zero_us) / (map.direction * map.us_per_q);
  }
  return position_q;
}

double opening_of(const ArmModel& arm, double pulse_us) {
  return std::clamp((pulse_us - arm.gripper.closed_us) / (arm.gripper.open_us - arm.gripper.closed_us), 0.0,
                    1.0);
}

}  // namespace

BusReading refined(BusReading reading, const ServoFrame& last) {
  if (reading.unit != BusReading::Unit::kPulses) return reading;
  for (std::size_t i = 0; i < std::min<std::size_t>(last.servo_count, kMaxServos); ++i) {
    if (std::abs(reading.value[i] - last.pulse_us[i]) < reading.step_us) reading.value[i] = last.pulse_us[i];
  }
  return reading;
}

DevicePosition position_of(const ArmModel& arm, const BusReading& reading, bool kept_pulses) {
  DevicePosition position;
  position.opening = -1.0;
  if (reading.unit == BusReading::Unit::kNothing) return position;
  position.position_q = joints_of(arm, reading);
  if (reading.unit == BusReading::Unit::kJoints) {
    position.kind = DevicePosition::Kind::kMeasured;
    if (reading.gripper_us) position.opening = opening_of(arm, *reading.gripper_us);
    return position;
  }
  if (!kept_pulses || !are_pulses(reading, arm.dof + 1)) return position;
  position.kind = DevicePosition::Kind::kCommanded;
  position.opening = opening_of(arm, reading.value[arm.dof]);
  return position;
}

ServoFeedback feedback_of(const ArmModel& arm, const BusReading& reading, std::int64_t time_ns) {
  ServoFeedback feedback;
  feedback.measured = reading.unit == BusReading::Unit::kJoints;
  feedback.commanded = are_pulses(reading, arm.dof);
  feedback.time_ns = time_ns;
  if (feedback.measured || feedback.commanded) feedback.position_q = joints_of(arm, reading);
  if (feedback.measured && reading.gripper_us) feedback.opening = opening_of(arm, *reading.gripper_us);
  if (feedback.commanded && is_pulse(reading.value[arm.dof]))
    feedback.opening = opening_of(arm, reading.value[arm.dof]);
  return feedback;
}

bool may_be_pulses_of(const ArmModel& arm, const BusReading& before, const BusReading& now, double moved_us) {
  constexpr double kResolution_us = 10.0;  // the coarsest controller's
  if (!are_pulses(before, arm.dof) || !are_pulses(now, arm.dof)) return false;
  for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof + 1, kMaxServos); ++i) {
    if (std::abs(now.value[i] - before.value[i]) > kResolution_us + moved_us) return false;
  }
  return true;
}

}  // namespace corbot::rt
