// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// Tells whether a reported pulse width is one that the controller sends. For a servo without a pulse since
/// power-up it reports 0, or the least width.
[[nodiscard]] constexpr bool is_pulse(double pulse_us) noexcept {
  return pulse_us > 500.0 && pulse_us < 2550.0;
}

/// Replaces each pulse that may be exactly the last one sent by the sent one. A controller reports its pulses
/// in steps, and the arm would otherwise creep from one to the next with every Clear.
[[nodiscard]] BusReading refined(BusReading reading, const ServoFrame& last);

/// Returns the position by a reading before anything was sent. `kept_pulses`: the servos had their pulses
/// since the last program.
[[nodiscard]] DevicePosition position_of(const ArmModel& arm, const BusReading& reading, bool kept_pulses);

/// Returns the joints by a reading. Encoders measure them. A controller's pulses say nothing about the
/// shafts, and nothing at all about servos without pulses.
[[nodiscard]] ServoFeedback feedback_of(const ArmModel& arm, const BusReading& reading, std::int64_t time_ns);

/// Tells whether `now` may be the pulses of servos that have moved by at most `moved_us` since the reading
/// just `before` it. The arm is held at these, so one wrong reading must not count.
[[nodiscard]] bool may_be_pulses_of(const ArmModel& arm, const BusReading& before, const BusReading& now,
                                    double moved_us = 0.0);

}  // namespace corbot::rt
