// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

/// Stops every robot that is up here, or whose real-time task was started by hand, all at once, each by a
/// `corbot stop` of its own, and prints what became of each. Throws Failure: `robot` was given besides, none is
/// up, or one did not confirm its stop.
void stop_all(const std::string& robot, double timeout_s);

}  // namespace corbot::cli
