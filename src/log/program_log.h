// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot {

/// Lets spdlog write to standard error, with the program's name in each line, and never wait for a reader.
/// Otherwise a terminal stopped by Ctrl-S or a full pipe would hold a servant or a task that is to end.
void log_without_waiting(const std::string& program);

}  // namespace corbot
