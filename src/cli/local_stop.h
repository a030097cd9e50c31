// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

/// Stops a robot on this machine by its stop segment, without its servant; returns at rest. False when no
/// real-time task of that name runs here, or it died meanwhile: nothing moves then but by another one.
/// Throws Failure when the task does not confirm in time.
[[nodiscard]] bool stop_on_this_machine(const std::string& robot, double timeout_s);

}  // namespace corbot::cli
