// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "cli/program.h"
#include "client/client.h"

namespace corbot::cli {

/// "[#####     ]", `width` characters between the brackets; `ratio` is clamped to 0 … 1.
[[nodiscard]] std::string bar(double ratio, std::size_t width);

/// Reads and checks a program. Throws Failure, kUsage with one "file:line: reason" for each fault.
[[nodiscard]] Program load_program(const std::string& file);

/// Prints what would be done.
void print_program(const Program& program);

/// Carries the statements out one after the other, with a bar on a terminal and plain lines elsewhere. Throws
/// Failure with file and line of the statement that failed; those behind it are not begun.
void run_program(client::Client& client, const Program& program, const std::string& file);

}  // namespace corbot::cli
