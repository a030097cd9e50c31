// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/profile.h"

namespace corbot::cli {

enum class Level { kOk, kWarn, kFail };

/// One line of `corbot doctor`.
struct Finding {
  Level level{};
  std::string subject;
  std::string text;  ///< what was found
  std::string fix;   ///< what to do; empty when ok
};

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

/// The devices that a profile names. A serial line is opened and closed, and nothing is sent; of others the
/// files are checked.
[[nodiscard]] std::vector<Finding> examine_devices(const Profile& profile);

/// Does a list such as "1-3,5" contain `cpu`?
[[nodiscard]] bool cpu_list_contains(std::string_view list, int cpu);

/// Prints all; true unless one failed.
[[nodiscard]] bool doctor(const std::string& profile_file);

}  // namespace corbot::cli
