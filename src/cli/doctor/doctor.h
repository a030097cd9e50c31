// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/doctor/finding.h"

namespace corbot::cli {

/// Directories of the machine's files; tests use others.
struct MachineFiles {
  std::string proc{"/proc"};
  std::string sys{"/sys"};
};

/// Examines the machine's fitness for a real-time loop. `cpu`: the profile's, −1: no particular one; nothing
/// without a profile.
[[nodiscard]] std::vector<Finding> examine_machine(const MachineFiles& files, std::optional<int> cpu);

/// Examines the privileges of this user for real-time scheduling and locked memory.
[[nodiscard]] std::vector<Finding> examine_privileges(int priority);

/// Examines programs and ORB. If a profile is given, also examines the profile, its port and its devices.
[[nodiscard]] std::vector<Finding> examine_installation(const std::string& profile_file);

/// Returns true if a list such as "1-3,5" contains `cpu`.
[[nodiscard]] bool cpu_list_contains(std::string_view list, int cpu);

/// Prints all findings; returns true unless one is a failure.
[[nodiscard]] bool doctor(const std::string& profile_file);

}  // namespace corbot::cli
