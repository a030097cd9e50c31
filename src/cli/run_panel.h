// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::cli {

/// Replaces this process by corbot-panel with these arguments. Throws Failure if the program is not
/// installed.
[[noreturn]] void run_panel(std::vector<std::string> arguments);

}  // namespace corbot::cli
