// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// Whether a pulse width that a controller reports is one that it sends: of a servo that it has given no pulse since its
/// power-up it reports 0, or the least.
[[nodiscard]] constexpr bool is_pulse(double pulse_us) noexcept {
  return pulse_us > 500.0 && pulse_us < 2550.0;
}

/// A reading of pulses in which each servo that may have exactly what it was sent last has that: a controller tells its
/// pulses in steps, and the arm would creep from one to the next with every Clear.
[[nodiscard]] BusReading refined(BusReading reading, const ServoFrame& last);

/// What a reading says before anything has been sent. `kept_pulses`: the servos had their pulses since the last program.
[[nodiscard]] DevicePosition position_of(const ArmModel& arm, const BusReading& reading, bool kept_pulses);

/// What a reading says of the joints: by encoders they are measured; what a controller sends says nothing about the
/// shafts, and nothing at all of servos without pulses.
[[nodiscard]] ServoFeedback feedback_of(const ArmModel& arm, const BusReading& reading, std::int64_t time_ns);

/// Whether `now` may be what a controller sends to servos that rest: as the reading just `before` it, and within what the
/// profile lets them have. The arm is held where this says: one wrong reading must not count.
[[nodiscard]] bool may_be_pulses_of(const ArmModel& arm, const BusReading& before, const BusReading& now);

}  // namespace corbot::rt
