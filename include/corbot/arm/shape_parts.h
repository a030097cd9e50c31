// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "corbot/arm/workspace_limits.h"
#include "corbot/kinematics/arm_parts.h"

namespace corbot {

/// Tells whether a shape can hold for these parts of an arm: one of them exists, and no link
/// among them lacks its radius.
[[nodiscard]] inline bool can_hold_for(const WorkspaceLimits& limits, const ArmParts& arm,
                                       std::uint32_t parts) noexcept {
  bool has_one = false;
  for (std::size_t part = 0; part < kArmParts; ++part) {
    if ((parts & bit_of(part)) == 0 || !arm[part].exists) continue;
    if (part >= kFirstLink && !(radius_m(limits, part) > 0.0)) return false;
    has_one = true;
  }
  return has_one && parts <= kAllParts;
}

[[nodiscard]] inline std::vector<std::string> shape_names(const WorkspaceLimits& limits) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < limits.count; ++k) names.emplace_back(limits.shapes[k].name.data());
  return names;
}

/// Returns the names of parts, "tool, elbow". Not real-time safe.
[[nodiscard]] inline std::string part_names(std::uint32_t parts) {
  std::string text;
  for (std::size_t part = 0; part < kArmParts; ++part)
    if ((parts & bit_of(part)) != 0) text += (text.empty() ? "" : ", ") + std::string(kPartNames[part]);
  return text;
}

}  // namespace corbot
