// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/doctor/finding.h"

namespace corbot::cli {

/// Where the machine's files are; tests point it elsewhere.
struct MachineFiles {
  std::string proc{"/proc"};
  std::string sys{"/sys"};
};

/// The machine's fitness for a real-time loop. `cpu`: the profile's, −1: no
/// particular one; none without a profile.
[[nodiscard]] std::vector<Finding> examine_machine(const MachineFiles& files, std::optional<int> cpu);

/// Privileges of this user for real-time scheduling and locked memory.
[[nodiscard]] std::vector<Finding> examine_privileges(int priority);

/// Programs, ORB and, where a profile is given, the profile, its port and its devices.
[[nodiscard]] std::vector<Finding> examine_installation(const std::string& profile_file);

/// Does a list such as "1-3,5" contain `cpu`?
[[nodiscard]] bool cpu_list_contains(std::string_view list, int cpu);

/// Prints all; true unless one failed.
[[nodiscard]] bool doctor(const std::string& profile_file);

}  // namespace corbot::cli
