// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/approach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "corbot/arm/near_range.h"
#include "rt/backends/bus/approach_speed.h"
#include "rt/backends/bus/bus_reading.h"
#include "rt/backends/bus/tenths.h"

namespace corbot::rt {
namespace {

/// Speed of an approach in joint values, converted by near_q() for a sliding joint. No joint exceeds its
/// profile's limit.
constexpr double kApproach_rad_per_s = 0.5;

/// Joint values that differ by less are the same.
constexpr double kSame_q = 1e-6;
constexpr auto kOldestReport = std::chrono::milliseconds(250);  // of the pulses on an approach

constexpr double kMillimetres = 1000.0;  // in a metre

/// Returns the value in degrees, or in millimetres.
std::string value_text(JointKind kind, double value_q) {
  return tenths(kind == JointKind::kRotary ? to_degrees(value_q) : value_q * kMillimetres);
}

double ramp_q_per_s(const ArmModel& arm, std::size_t joint) {
  const double slow_q_s = near_q(arm.kinematics.joint_kind(joint), kApproach_rad_per_s);
  const double limit_q_s = arm.joints[joint].speed_q_s;
  return limit_q_s > 0.0 ? std::min(slow_q_s, limit_q_s) : slow_q_s;
}

bool is_same_place(const ServoFrame& a, const ServoFrame& b) {
  return a.pulse_us == b.pulse_us && a.position_q == b.position_q && a.servo_count == b.servo_count;
}

/// Moves all coordinates in small steps, each by itself.
class Ramps {
 public:
  Ramps(const ArmModel& arm, double dt_s) : arm_(arm), dt_s_(dt_s) {}

  /// Returns true when all rest at `target`.
  bool step(ServoFrame& at, const ServoFrame& target) {
    return for_all(target.servo_count,
                   [&](ApproachRamp& ramp, auto values, std::size_t i, const auto& limits) {
                     return ramp.step((at.*values)[i], (target.*values)[i], limits, dt_s_);
                   });
  }
  /// Returns true when all rest.
  bool halt(ServoFrame& at) {
    return for_all(at.servo_count, [&](ApproachRamp& ramp, auto values, std::size_t i, const auto& limits) {
      return ramp.halt((at.*values)[i], limits, dt_s_);
    });
  }
  [[nodiscard]] bool rest() const {
    const auto rests = [](const ApproachRamp& ramp) { return ramp.rests(); };
    return std::all_of(pulses_.begin(), pulses_.end(), rests) &&
           std::all_of(joints_.begin(), joints_.end(), rests);
  }

 private:
  template <class Step>
  bool for_all(std::size_t servos, Step&& step) {
    bool all = true;
    for (std::size_t i = 0; i < std::min(servos, kMaxServos); ++i)
      all &= step(pulses_[i], &ServoFrame::pulse_us, i, pulse_limits(arm_, i));
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const ApproachLimits limits{ramp_q_per_s(arm_, i), arm_.joints[i].acceleration_q_s2};
      all &= step(joints_[i], &ServoFrame::position_q, i, limits);
    }
    return all;
  }

  const ArmModel& arm_;
  const double dt_s_;
  std::array<ApproachRamp, kMaxServos> pulses_{};
  std::array<ApproachRamp, kMaxJoints> joints_{};
};

}  // namespace

Approach::Approach(const ArmModel& arm, BusDevice& device, FrameSender& sender, NewestFrame& newest,
                   std::chrono::milliseconds stagger, IsStopped is_stopped, Report report, Pause pause)
    : arm_(arm),
      device_(device),
      sender_(sender),
      newest_(newest),
      stagger_(stagger),
      is_stopped_(std::move(is_stopped)),
      report_(std::move(report)),
      pause_until_(std::move(pause)) {}

void Approach::halt_left_over() {
  if (may_be_moving_) device_.halt();
  may_be_moving_ = false;
}

Approach::Outcome Approach::run(const std::optional<BusReading>& found) {
  const ServoFrame frame = newest_.read();
  if (is_stopped_(frame)) return Outcome::kStopped;
  ServoFrame from = sender_.last().servo_count > 0 ? sender_.last() : frame;
  from.servo_count = frame.servo_count;
  const BusReading reading = device_.measure(frame);
  // A drive that holds its load would jump to a guessed position.
  if (reading.unit == BusReading::Unit::kNothing && device_.has_encoders()) {
    throw DeviceError(DeviceCause::kNoAnswer, "the device reports no position");
  }
  const bool interpolates = device_.approach_ns() > 0;
  // Under load a shaft lags its target. If each Clear began at the shaft, the arm would sink by the lag.
  const BusReading held = device_.held().value_or(reading);
  begin_at(held, from);
  const Outcome outcome = give_first_pulses(interpolates ? frame : from, reading);
  if (outcome != Outcome::kThere) return outcome;
  if (interpolates) return await_interpolation(frame);
  if (!device_.has_encoders()) return ramp_to_newest(from, std::nullopt);
  if (found) {
    check_not_turned(*found, reading);
  } else {
    const Outcome end = hold_until_followed(from, is_beyond_range(reading) ? reading : held);
    if (end != Outcome::kThere) return end;
  }
  return ramp_to_newest(from, held);
}

void Approach::check_not_turned(const BusReading& found, const BusReading& now) const {
  for (std::size_t i = 0; found.unit == BusReading::Unit::kJoints && i < arm_.dof; ++i) {
    const JointKind kind = arm_.kinematics.joint_kind(i);
    const bool turns = kind == JointKind::kRotary;
    const double most_q = near_q(kind, kMostTurned_rad);
    if (std::abs(now.value[i] - found.value[i]) <= most_q) continue;
    throw DeviceError(DeviceCause::kNone,
                      "joint " + std::to_string(i) + " was " + (turns ? "turned" : "pushed") +
                          " while the drives were being enabled, from " + value_text(kind, found.value[i]) +
                          " to " + value_text(kind, now.value[i]) + (turns ? " degrees" : " mm") +
                          ", more than " + value_text(kind, most_q) +
                          ": hold the arm still, then start again");
  }
}

Approach::Outcome Approach::hold_until_followed(const ServoFrame& from, const BusReading& reading) {
  for (auto due = Clock::now();;) {
    ServoFrame frame = newest_.read();
    if (is_stopped_(frame)) return Outcome::kStopped;
    // A position beyond its range is no beginning: the cycle reports an Error for it.
    if (!is_beyond_range(reading) && begins_at(from, frame)) return Outcome::kThere;
    report_(reading);
    frame.pulse_us = from.pulse_us;
    frame.position_q = from.position_q;
    sender_.send_on_the_way(frame, false);
    (void)device_.measure(frame);  // throws if a drive has failed
    due = std::max(due + std::chrono::nanoseconds(device_.period_ns()), Clock::now());
    if (!pause_until_(due)) return Outcome::kEnd;
  }
}

/// Tests whether a joint is further outside its range than an encoder's error.
bool Approach::is_beyond_range(const BusReading& reading) const {
  for (std::size_t i = 0; reading.unit == BusReading::Unit::kJoints && i < arm_.dof; ++i) {
    const JointLimits& joint = arm_.joints[i];
    const double there_q = std::clamp(reading.value[i], joint.lower_q, joint.upper_q);
    if (!(std::abs(reading.value[i] - there_q) <=
          near_q(arm_.kinematics.joint_kind(i), kNearRangeMeasured_rad) + kSame_q))
      return true;
  }
  return false;
}

bool Approach::begins_at(const ServoFrame& from, const ServoFrame& newest) const {
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const JointLimits& joint = arm_.joints[i];
    const double there_q = std::clamp(from.position_q[i], joint.lower_q, joint.upper_q);
    if (!(std::abs(newest.position_q[i] - there_q) <= kSame_q)) return false;
  }
  return true;
}

void Approach::begin_at(const BusReading& reading, ServoFrame& from) const {
  for (std::size_t i = 0; reading.unit == BusReading::Unit::kPulses && i < kMaxServos; ++i) {
    if (is_pulse(reading.value[i])) from.pulse_us[i] = reading.value[i];
  }
  for (std::size_t i = 0; reading.unit == BusReading::Unit::kJoints && i < arm_.dof; ++i) {
    from.position_q[i] = reading.value[i];
  }
  if (reading.gripper_us && arm_.dof < kMaxServos) from.pulse_us[arm_.dof] = *reading.gripper_us;
}

Approach::Outcome Approach::wait_until(Clock::time_point due) {
  while (!is_stopped_(newest_.read())) {
    const auto now = Clock::now();
    if (now >= due) return Outcome::kThere;
    if (!pause_until_(std::min(due, now + std::chrono::nanoseconds(device_.period_ns()))))
      return Outcome::kEnd;
  }
  return Outcome::kStopped;
}

Approach::Outcome Approach::give_first_pulses(const ServoFrame& frame, const BusReading& reading) {
  if (stagger_ <= std::chrono::milliseconds(0) || reading.unit == BusReading::Unit::kJoints)
    return Outcome::kThere;
  const bool interpolates = device_.approach_ns() > 0;
  const std::size_t servos = std::min<std::size_t>(frame.servo_count, kMaxServos);
  for (std::uint32_t count = 1; count < servos; ++count) {
    if (reading.unit == BusReading::Unit::kPulses && is_pulse(reading.value[count - 1])) continue;
    ServoFrame first = frame;
    first.servo_count = count;  // the other servos keep their state
    may_be_moving_ = interpolates;
    bool is_sent = false;
    Outcome outcome = Outcome::kThere;
    while (!is_sent && outcome == Outcome::kThere) {
      is_sent = sender_.send_on_the_way(first, interpolates);
      outcome = wait_until(Clock::now() + (is_sent ? Clock::duration(stagger_)
                                                   : std::chrono::nanoseconds(device_.period_ns())));
    }
    if (outcome == Outcome::kThere) continue;
    halt_left_over();
    return outcome;
  }
  return Outcome::kThere;
}

/// After a Stop on the way the cycle holds the arm at a reported reading. One wrong reading must not count.
/// Nor must an old one, since the servos would turn far back to it.
std::optional<bool> Approach::look() {
  BusReading reading;
  const std::optional<bool> has_arrived = device_.has_arrived(reading);
  const auto now = Clock::now();
  const double moved_us =
      kApproach_us_per_s * std::chrono::duration<double>(now - std::exchange(seen_at_, now)).count();
  if (may_be_pulses_of(arm_, std::exchange(seen_, reading), reading, moved_us)) {
    report_(refined(reading, sender_.last()));
    reported_at_ = now;
  } else if (now - reported_at_ > kOldestReport) {
    report_(BusReading{});
  }
  return has_arrived;
}

Approach::Outcome Approach::await_interpolation(ServoFrame newest) {
  std::int64_t left_ns = 0;  // of a motion that was requested
  bool is_under_way = false;
  seen_ = {};
  reported_at_ = Clock::now();
  for (;;) {
    newest = newest_.read();
    if (is_stopped_(newest)) {
      halt_left_over();
      return Outcome::kStopped;
    }
    if (!is_under_way || !is_same_place(newest, sender_.last())) {
      may_be_moving_ = is_under_way = true;
      sender_.send_on_the_way(newest, true);
      left_ns = device_.approach_ns();
    } else if (look().value_or(left_ns <= 0)) {
      if (left_ns <= 0) {
        may_be_moving_ = false;
        return Outcome::kThere;
      }
    } else if (left_ns < -device_.approach_ns()) {
      throw DeviceError(DeviceCause::kDeviceFault,
                        "the servos did not reach their start position in twice the planned time");
    }
    const std::int64_t period_ns =
        left_ns > 0 ? std::min(device_.period_ns(), std::max<std::int64_t>(left_ns, 1'000'000))
                    : device_.period_ns();
    left_ns -= period_ns;
    if (!pause_until_(Clock::now() + std::chrono::nanoseconds(period_ns))) {
      halt_left_over();
      return Outcome::kEnd;
    }
  }
}

Approach::Outcome Approach::ramp_to_newest(ServoFrame at, const std::optional<BusReading>& held) {
  Ramps ramps(arm_, static_cast<double>(device_.period_ns()) * 1e-9);
  bool is_stopping = false;
  auto due = Clock::now();
  for (;;) {
    ServoFrame target = newest_.read();
    is_stopping = is_stopped_(target) || is_stopping;
    // The pulses of measured joints have no meaning for the device, and need no ramp.
    if (held)
      std::copy_n(target.pulse_us.begin(), std::min<std::size_t>(arm_.dof, kMaxServos), at.pulse_us.begin());
    if (is_stopping && ramps.rest()) return Outcome::kStopped;
    const bool rests = is_stopping ? ramps.halt(at) : ramps.step(at, target);
    target.pulse_us = at.pulse_us;
    target.position_q = at.position_q;
    if (rests && !is_stopping) {
      if (sender_.send(target)) return Outcome::kThere;
    } else {
      sender_.send_on_the_way(target, false);
    }
    // Pulses are reported as they go: after a Stop on the way the cycle holds the arm at the last ones. A
    // measuring device is reported at its held target. The cycle follows the report, and each other reading
    // would let the arm creep.
    if (held) (void)device_.measure(target);
    report_(held.value_or(BusReading{BusReading::Unit::kPulses, at.pulse_us, {}}));
    due = std::max(due + std::chrono::nanoseconds(device_.period_ns()), Clock::now());  // never a burst
    if (!pause_until_(due)) return Outcome::kEnd;
  }
}

}  // namespace corbot::rt
