// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

/// Stops every robot that is up here, or whose real-time task was started by hand, all at once. Runs a
/// separate `corbot stop` for each robot and prints the results. Throws Failure if `robot` was given as well,
/// none is up, or one did not confirm its stop.
void stop_all(const std::string& robot, double timeout_s);

}  // namespace corbot::cli
