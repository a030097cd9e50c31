// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

/// Stops a robot on this machine by its stop segment, without its servant; returns when the arm is at rest,
/// or held by an Error. False when no real-time task of that name runs here, or it ended before it confirmed:
/// nothing moves then but by another one. Throws Failure when this user may not stop it, or the task does not
/// confirm in time; the stop may have been counted all the same, and is carried out when the task goes on.
[[nodiscard]] bool stop_on_this_machine(const std::string& robot, double timeout_s);

}  // namespace corbot::cli
