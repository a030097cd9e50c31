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

template <class List>
nlohmann::json numbers(const List& list) {
  nlohmann::json numbers = nlohmann::json::array();
  for (CORBA::ULong i = 0; i < list.length(); ++i) numbers.push_back(list[i]);
  return numbers;
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

nlohmann::json loop_data(const Corbot::LoopInfo& info) {
  return {{"period_s", info.period},
          {"since_s", info.since},
          {"cycles", info.cycles},
          {"overruns", info.overruns},
          {"latency_mean_s", info.latencyMean},
          {"latency_max_s", info.latencyMax},
          {"work_max_s", info.workMax},
          {"real_time", static_cast<bool>(info.realTime)},
          {"latency_counts", numbers(info.counts)},
          {"latency_edges_s", numbers(info.edges)}};
}

}  // namespace corbot::client
