// SPDX-License-Identifier: Apache-2.0
#include "client/json_view.h"

#include <nlohmann/json.hpp>

#include "client/explain.h"

namespace corbot::client {

namespace {

const char* holding_word(Corbot::HoldingState holding) {
  switch (holding) {
    case Corbot::HoldingYes:
      return "yes";
    case Corbot::HoldingNo:
      return "no";
    default:
      return "unknown";
  }
}

}  // namespace

const char* to_string(Corbot::RobotState state) {
  switch (state) {
    case Corbot::Error:
      return "Error";
    case Corbot::Waiting:
      return "Waiting";
    default:
      return "Standby";
  }
}

nlohmann::json gripper_data(const Corbot::GripperInfo& info) {
  return {{"commanded_percent", info.commanded},
          {"measured", static_cast<bool>(info.measured)},
          {"opening_percent", info.opening},
          {"holding", holding_word(info.holding)}};
}

nlohmann::json device_data(const Corbot::DeviceInfo& device) {
  return {{"backend", printable(device.backend.in())},
          {"health", to_string(device.health)},
          {"cause", device.cause},
          {"cause_text", printable(device.causeText.in())},
          {"frames", device.frames},
          {"age_s", device.age},
          {"age_max_s", device.ageMax},
          {"measured", static_cast<bool>(device.measured)},
          {"measured_age_s", device.measuredAge},
          {"position_uncertain", static_cast<bool>(device.positionUncertain)},
          {"emergency_stop", static_cast<bool>(device.emergencyStop)}};
}

}  // namespace corbot::client
