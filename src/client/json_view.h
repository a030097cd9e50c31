// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "arm.hh"

// Converts states to the JSON that the commands' --json and the panel share.

namespace corbot::client {

/// "Standby", "Waiting" or "Error".
[[nodiscard]] const char* to_string(Corbot::RobotState state);
[[nodiscard]] nlohmann::json gripper_data(const Corbot::GripperInfo& info);
[[nodiscard]] nlohmann::json device_data(const Corbot::DeviceInfo& device);
[[nodiscard]] nlohmann::json loop_data(const Corbot::LoopInfo& info);

}  // namespace corbot::client
