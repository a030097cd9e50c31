// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace corbot::client {

/// Stops a robot on this machine by its stop segment, without its servant. Returns true when the arm is at
/// rest, or held by an Error. Returns false if no real-time task of that name runs here, or it ended before
/// it confirmed: nothing moves then except by another task. Also returns false, and stops nothing, if the
/// robot that is up by its state file has another task. Throws Failure if this user may not stop it, or the
/// task does not confirm in time. In that case the stop may still be counted, and the task carries it out
/// when it resumes.
[[nodiscard]] bool stop_on_this_machine(const std::string& robot, double timeout_s);

/// Stops a robot by its stop segment if it is on this machine, else by `by_servant`. Throws the Failure of
/// both. `robot` empty: the robot is elsewhere.
void stop_here_or(const std::string& robot, double timeout_s, const std::function<void()>& by_servant);

}  // namespace corbot::client
