// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/approach.h"

#include <algorithm>
#include <utility>

#include "rt/backends/bus/approach_speed.h"

namespace corbot::rt {
namespace {

/// Of an approach in joint angles; no joint faster than its profile allows.
constexpr double kApproach_rad_per_s = 0.5;
constexpr auto kLook = std::chrono::milliseconds(20);

double ramp_rad_per_s(const JointLimits& joint) {
  return joint.speed_rad_s > 0.0 ? std::min(kApproach_rad_per_s, joint.speed_rad_s) : kApproach_rad_per_s;
}

bool is_same_place(const ServoFrame& a, const ServoFrame& b) {
  return a.pulse_us == b.pulse_us && a.position_rad == b.position_rad;
}

/// One step towards `target`; true when it is reached.
bool step(double& value, double target, double most) {
  value += std::clamp(target - value, -most, most);
  return value == target;
}

}  // namespace

Approach::Approach(const ArmModel& arm, BusDevice& device, FrameSender& sender,
                   const SnapshotCell<ServoFrame>& newest, EmergencyStop& stop, Pause pause)
    : arm_(arm),
      device_(device),
      sender_(sender),
      newest_(newest),
      stop_(stop),
      pause_until_(std::move(pause)) {}

bool Approach::is_stopped(const ServoFrame& newest) {
  stop_.set(StopSource::kDevice, device_.emergency_stop());
  return newest.emergency_stop || stop_.sources() != 0;
}

/// The cycle, which latches a stop, does not run yet during the start: there a stop ends the approach.
bool Approach::is_held(const ServoFrame& newest) {
  if (!is_stopped(newest)) return false;
  if (is_starting_) throw DeviceError(DeviceCause::kNone, "the emergency stop was pressed; start again");
  return true;
}

bool Approach::await_release() {
  ServoFrame newest;
  while (device_.energises_at_open() && newest_.load(newest) && is_stopped(newest)) {
    if (!pause_until_(Clock::now() + kLook)) return false;
  }
  return true;
}

bool Approach::run(bool is_starting) {
  is_starting_ = is_starting;
  ServoFrame frame;
  if (!newest_.load(frame)) throw DeviceError(DeviceCause::kNoAnswer, "no frame to approach");
  if (device_.approach_ns() > 0) {
    try {
      return await_interpolation(frame);
    } catch (const DeviceError&) {
      // A start that has failed is not tried again.
      if (is_starting_ && may_be_moving_) device_.halt();
      throw;
    }
  }
  ServoFrame from = sender_.last().servo_count > 0 ? sender_.last() : frame;
  const BusReading reading = device_.measure(frame);
  // A drive that holds its load would jump if its position were guessed.
  if (reading.unit == BusReading::Unit::kNothing && device_.energises_at_open()) {
    throw DeviceError(DeviceCause::kNoAnswer, "the device reports no position");
  }
  if (reading.unit == BusReading::Unit::kPulses) from.pulse_us = reading.value;
  for (std::size_t i = 0; reading.unit == BusReading::Unit::kJoints && i < arm_.dof; ++i) {
    from.position_rad[i] = reading.value[i];
  }
  if (reading.gripper_us && arm_.dof < kMaxServos) from.pulse_us[arm_.dof] = *reading.gripper_us;
  return ramp_to_newest(from, reading.unit != BusReading::Unit::kNothing);
}

bool Approach::await_interpolation(const ServoFrame& frame) {
  std::int64_t left_ns = 0;  // of a motion that has been asked for
  bool is_under_way = false;
  ServoFrame newest = frame;
  for (;;) {
    (void)newest_.load(newest);
    if (is_held(newest)) {
      if (may_be_moving_) device_.halt();
      may_be_moving_ = is_under_way = false;
    } else if (!is_under_way || (left_ns <= 0 && !is_same_place(newest, sender_.last()))) {
      may_be_moving_ = is_under_way = true;
      sender_.send(newest, true);
      left_ns = device_.approach_ns();
    } else if (left_ns <= 0) {
      may_be_moving_ = false;
      return true;
    }
    const std::int64_t period_ns = std::min(device_.period_ns(), std::max<std::int64_t>(left_ns, 1'000'000));
    left_ns -= period_ns;
    if (!pause_until_(Clock::now() + std::chrono::nanoseconds(period_ns))) {
      if (is_under_way) device_.halt();
      may_be_moving_ = false;
      return false;
    }
  }
}

bool Approach::ramp_to_newest(ServoFrame at, bool is_holding) {
  const double period_s = static_cast<double>(device_.period_ns()) * 1e-9;
  auto due = Clock::now();
  for (;;) {
    ServoFrame target;
    if (newest_.load(target)) {
      const double step_s = is_held(target) ? 0.0 : period_s;
      is_holding |= step_s > 0.0;
      bool is_there = true;
      for (std::size_t i = 0; i < std::min<std::size_t>(target.servo_count, kMaxServos); ++i) {
        is_there &= step(at.pulse_us[i], target.pulse_us[i], kApproach_us_per_s * step_s);
      }
      for (std::size_t i = 0; i < arm_.dof; ++i) {
        is_there &= step(at.position_rad[i], target.position_rad[i], ramp_rad_per_s(arm_.joints[i]) * step_s);
      }
      target.pulse_us = at.pulse_us;
      target.position_rad = at.position_rad;
      // Servos without pulses get none while the arm is stopped: they would run to the first one.
      if (is_holding) sender_.send(target, false);
      if (is_there && is_holding) return true;
    }
    due = std::max(due + std::chrono::nanoseconds(device_.period_ns()), Clock::now());  // never a burst
    if (!pause_until_(due)) return false;
  }
}

}  // namespace corbot::rt
