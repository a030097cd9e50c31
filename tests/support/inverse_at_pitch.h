// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/kinematics/tool_pose.h"

namespace corbot::test {

/// Joints of a four-axis arm for a position and a tool pitch.
[[nodiscard]] inline IkSolution inverse_at_pitch(const Kinematics& arm, const Vector3& position_m,
                                                 double pitch_rad, std::uint32_t number, const Joints& hint) {
  return arm.inverse_at(position_m, {angle_of_pitch(arm, pitch_rad)}, number, hint);
}

}  // namespace corbot::test
