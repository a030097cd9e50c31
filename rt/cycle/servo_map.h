// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"

namespace corbot::rt {

/// Returns the pulse width in microseconds for a joint value, bounded to the servo's range. A value that is
/// not a number leaves the servo at its position: the result is then `last_us`, and never NaN as long as
/// `last_us` is not. Real-time safe.
[[nodiscard]] double joint_pulse_us(const ServoMap& servo, double position_q, double last_us) noexcept;

/// Returns the pulse width in microseconds for a gripper opening, 0 closed … 1 open; bounded, too. Real-time
/// safe.
[[nodiscard]] double gripper_pulse_us(const GripperModel& gripper, double opening, double last_us) noexcept;

/// Fills pulses, channels and positions of a frame: joints first, then the gripper. Real-time safe.
void map_to_pulses(const ArmModel& arm, const Joints& position_q, double opening, ServoFrame& frame) noexcept;

}  // namespace corbot::rt
