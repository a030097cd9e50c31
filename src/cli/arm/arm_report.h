// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/arm/solutions.h"
#include "config/profile.h"
#include "planner/workspace.h"

namespace corbot::cli {

/// What `corbot kinematics` prints.
struct ArmReport {
  const Profile& profile;
  Workspace workspace;
  PoseSolutions at;
  std::vector<std::string> doubts;  ///< doubts.h
};

[[nodiscard]] std::string arm_text(const ArmReport& report);
[[nodiscard]] std::string arm_json(const ArmReport& report);

}  // namespace corbot::cli
