// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/status_report.h"

// Joints in the units for people and programs: degrees for rotary joints, metres for sliding ones.

namespace corbot::cli {

[[nodiscard]] inline bool is_limited(const StatusReport& r, std::size_t joint) {
  if (joint >= r.ranges.size() || joint >= r.soft_limits.size()) return false;
  return r.soft_limits[joint].lower != r.ranges[joint].lower ||
         r.soft_limits[joint].upper != r.ranges[joint].upper;
}

[[nodiscard]] inline bool slides(const StatusReport& r, std::size_t joint) {
  return joint < r.joint_info.size() && r.joint_info[joint].slides;
}

/// Rounds, without a minus sign in front of zeros.
[[nodiscard]] inline double rounded(double value, double scale) {
  const double r = std::round(value * scale) / scale;
  return r == 0 ? 0 : r;
}

/// Returns "   12.34 deg", "  0.0123 m  ".
[[nodiscard]] inline std::string joint_text(const StatusReport& r, std::size_t joint) {
  return slides(r, joint) ? fmt::format("{:8.4f} m  ", rounded(r.joints[joint], 1e4))
                          : fmt::format("{:8.2f} deg", rounded(r.joints[joint], 100));
}

[[nodiscard]] inline nlohmann::json range_data(const Corbot::JointRange& range) {
  return {range.lower, range.upper};
}

/// Returns the joints as JSON. Keys contain the unit: degrees or metres.
[[nodiscard]] inline nlohmann::json joints_data(const StatusReport& r) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < r.joints.size(); ++i) {
    const std::string unit = slides(r, i) ? "_m" : "_deg";
    nlohmann::json joint{{"value" + unit, r.joints[i]}};
    if (i < r.joint_info.size()) joint["name"] = r.joint_info[i].name;
    if (i < r.ranges.size()) joint["range" + unit] = range_data(r.ranges[i]);
    if (i < r.soft_limits.size()) joint["soft_limits" + unit] = range_data(r.soft_limits[i]);
    list.push_back(joint);
  }
  return list;
}

}  // namespace corbot::cli
