// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/arm/solutions.h"
#include "config/profile.h"
#include "planner/workspace.h"

namespace corbot::cli {

/// The content of `corbot kinematics`.
struct ArmReport {
  const Profile& profile;
  Workspace workspace;
  PoseSolutions at;
  std::vector<std::string> doubts;  ///< see doubts.h
};

[[nodiscard]] std::string arm_text(const ArmReport& report);
[[nodiscard]] std::string arm_json(const ArmReport& report);

}  // namespace corbot::cli
