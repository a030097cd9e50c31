// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "client/client.h"
#include "client/program.h"

namespace corbot::cli {

/// Returns "[#####     ]" with `width` characters between the brackets; `ratio` is clamped to 0 … 1.
[[nodiscard]] std::string bar(double ratio, std::size_t width);

/// Reads and checks a program. Throws Failure, kUsage with one "file:line: reason" for each fault.
[[nodiscard]] client::Program load_program(const std::string& file);

/// Prints the statements without executing them.
void print_program(const client::Program& program);

/// Prints the statements that the arm of a profile can carry out, without executing them. Throws Failure with
/// file and line of the first statement that the planner refuses. Draws the motions into the file `picture`,
/// if given.
void check_reach(const client::Program& program, const std::string& profile, const std::string& picture = "");

/// Executes the statements in order, with a progress bar on a terminal and plain lines elsewhere. Throws
/// Failure with file and line of the failed statement; later statements are not started.
void run_program(client::Client& client, const client::Program& program);

}  // namespace corbot::cli
