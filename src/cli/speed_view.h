// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "cli/status_report.h"

namespace corbot::cli {

/// Returns "5 %, joint 0 50 %": the speed of the tool, and of the joints whose speed is not 100 %.
[[nodiscard]] inline std::string speeds_text(const StatusReport& r) {
  if (!r.speeds) return "not known: the servant is of an earlier version";
  std::string text = fmt::format("{:.6g} %", r.speeds->tool);
  const Corbot::JointPercents& joints = r.speeds->joints;
  for (CORBA::ULong i = 0; i < joints.length(); ++i) {
    if (joints[i] < 100.0) text += fmt::format(", joint {} {:.6g} %", i, joints[i]);
  }
  return text;
}

[[nodiscard]] inline nlohmann::json speeds_data(const StatusReport& r) {
  if (!r.speeds) return {};
  nlohmann::json joints = nlohmann::json::array();
  for (CORBA::ULong i = 0; i < r.speeds->joints.length(); ++i) joints.push_back(r.speeds->joints[i]);
  return {{"tool", r.speeds->tool}, {"joints", joints}};
}

}  // namespace corbot::cli
