// SPDX-License-Identifier: Apache-2.0
// How a device comes to where the cycle holds the arm: at the start, after it was lost, after it stalled.
#include <algorithm>
#include <cmath>

#include "rt/backends/bus/bus_backend.h"

namespace corbot::rt {
namespace {

using Clock = std::chrono::steady_clock;

/// Of a device that is led: a fifth of what a servo can; no joint faster than its profile allows.
constexpr double kLead_us_per_s = 400.0;
constexpr double kLead_rad_per_s = 0.5;
/// After a stall, the device catches up at so many times the speed that the profile allows.
constexpr double kCatchUp = 2.0;
constexpr auto kLook = std::chrono::milliseconds(20);

double lead_rad_per_s(const JointLimits& joint) {
  return joint.speed_rad_s > 0.0 ? std::min(kLead_rad_per_s, joint.speed_rad_s) : kLead_rad_per_s;
}

/// One step towards `target`; true when it is reached.
bool step(double& value, double target, double most) {
  value += std::clamp(target - value, -most, most);
  return value == target;
}

/// The share of a way that may be gone.
double share_of(double way, double most) {
  return most > 0.0 && std::abs(way) > most ? most / std::abs(way) : 1.0;
}

}  // namespace

bool BusBackend::is_stopped(const ServoFrame& newest) {
  stop_.set(StopSource::kDevice, device_->emergency_stop());
  return newest.emergency_stop || stop_.sources() != 0;
}

/// While nobody latches a stop, since the cycle does not run yet, it ends the start.
bool BusBackend::is_held(const ServoFrame& newest) {
  if (!is_stopped(newest)) return false;
  if (is_starting_) throw DeviceError(DeviceCause::kNone, "the emergency stop was pressed; start again");
  return true;
}

bool BusBackend::await_release() {
  ServoFrame newest;
  while (device_->energises_at_open() && newest_.load(newest) && is_stopped(newest)) {
    if (!pause_until(Clock::now() + kLook)) return false;
  }
  return true;
}

bool BusBackend::approach() {
  feedback_.store(ServoFeedback{});  // what was measured before is old
  counted_.age_max_ns = 0;
  ServoFrame frame;
  if (!newest_.load(frame)) throw DeviceError(DeviceCause::kNoAnswer, "no frame to approach");
  if (device_->approach_ns() > 0) {
    try {
      return await_approach(frame);
    } catch (const DeviceError&) {
      // Nobody comes back to a start that has failed.
      if (is_starting_ && may_be_moving_) device_->halt();
      throw;
    }
  }
  ServoFrame from = last_sent_.servo_count > 0 ? last_sent_ : frame;
  const BusReading reading = device_->measure(frame);
  // What holds its load stands somewhere, and whoever guessed where would make it jump.
  if (reading.unit == BusReading::Unit::kNothing && device_->energises_at_open()) {
    throw DeviceError(DeviceCause::kNoAnswer, "the device does not tell where it stands");
  }
  if (reading.unit == BusReading::Unit::kPulses) from.pulse_us = reading.value;
  for (std::size_t i = 0; reading.unit == BusReading::Unit::kJoints && i < arm_.dof; ++i) {
    from.position_rad[i] = reading.value[i];
  }
  if (reading.gripper_us && arm_.dof < kMaxServos) from.pulse_us[arm_.dof] = *reading.gripper_us;
  return lead(from, reading.unit != BusReading::Unit::kNothing);
}

bool BusBackend::await_approach(const ServoFrame& frame) {
  std::int64_t left_ns = 0;  // of a motion that has been asked for
  bool is_under_way = false;
  ServoFrame newest = frame;
  for (;;) {
    (void)newest_.load(newest);
    if (is_held(newest)) {
      if (may_be_moving_) device_->halt();
      may_be_moving_ = is_under_way = false;
    } else if (!is_under_way) {
      may_be_moving_ = is_under_way = true;
      send(newest, true);
      left_ns = device_->approach_ns();
    } else if (left_ns <= 0) {
      may_be_moving_ = false;
      return true;
    }
    const std::int64_t period_ns = std::min(device_->period_ns(), std::max<std::int64_t>(left_ns, 1'000'000));
    left_ns -= period_ns;
    if (!pause_until(Clock::now() + std::chrono::nanoseconds(period_ns))) {
      if (is_under_way) device_->halt();
      may_be_moving_ = false;
      return false;
    }
  }
}

bool BusBackend::lead(ServoFrame at, bool is_holding) {
  const double period_s = static_cast<double>(device_->period_ns()) * 1e-9;
  auto due = Clock::now();
  for (;;) {
    ServoFrame target;
    if (newest_.load(target)) {
      const double step_s = is_held(target) ? 0.0 : period_s;
      is_holding |= step_s > 0.0;
      bool is_there = true;
      for (std::size_t i = 0; i < std::min<std::size_t>(target.servo_count, kMaxServos); ++i) {
        is_there &= step(at.pulse_us[i], target.pulse_us[i], kLead_us_per_s * step_s);
      }
      for (std::size_t i = 0; i < arm_.dof; ++i) {
        is_there &= step(at.position_rad[i], target.position_rad[i], lead_rad_per_s(arm_.joints[i]) * step_s);
      }
      target.pulse_us = at.pulse_us;
      target.position_rad = at.position_rad;
      // Servos without pulses get none while the arm is stopped: they would run to the first one.
      if (is_holding) send(target, false);
      if (is_there && is_holding) return true;
    }
    due = std::max(due + std::chrono::nanoseconds(device_->period_ns()), Clock::now());  // never a burst
    if (!pause_until(due)) return false;
  }
}

void BusBackend::limit_step(ServoFrame& next) const {
  const ServoFrame& last = last_sent_;
  if (last.servo_count != next.servo_count || next.servo_count <= arm_.dof) return;
  const double period_s = static_cast<double>(device_->period_ns()) * 1e-9;
  const double longest_s = period_s + static_cast<double>(device_->longest_gap_ns()) * 1e-9;
  const double time_s =
      std::clamp(static_cast<double>(next.time_ns - last.time_ns) * 1e-9, period_s, longest_s);
  // All joints the same share of their ways: the arm stays on its path, but for the chord.
  double share = 1.0;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const double way = next.position_rad[i] - last.position_rad[i];
    share = std::min(share, share_of(way, kCatchUp * arm_.joints[i].speed_rad_s * time_s));
  }
  if (share < 1.0) {
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      next.position_rad[i] = std::lerp(last.position_rad[i], next.position_rad[i], share);
      next.pulse_us[i] = std::lerp(last.pulse_us[i], next.pulse_us[i], share);
    }
  }
  const GripperModel& gripper = arm_.gripper;
  const double travel_us = std::abs(gripper.open_us - gripper.closed_us);
  const double most_us = gripper.travel_s > 0.0 ? kCatchUp * travel_us / gripper.travel_s * time_s : 0.0;
  const double way_us = next.pulse_us[arm_.dof] - last.pulse_us[arm_.dof];
  next.pulse_us[arm_.dof] = last.pulse_us[arm_.dof] + share_of(way_us, most_us) * way_us;
}

}  // namespace corbot::rt
