// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace corbot::cli {

/// A real-time task or a servant that holds the shared memory of a robot.
struct RobotProcess {
  pid_t pid;
  std::string program;  ///< "corbot-rt"
  pid_t supervisor;     ///< the `corbot up` that started it; 0: none
};

/// Returns the living processes of this user, the servants first. The location of their supervisor's files
/// does not matter.
[[nodiscard]] std::vector<RobotProcess> find_robot_processes(const std::string& name);

/// Returns "corbot up (pid 12)" or "corbot-rt (pid 13), corbot-servant (pid 14)".
[[nodiscard]] std::string describe(const std::vector<RobotProcess>& processes);

/// Sends a signal to the robot's servant. Returns false if this user has none. Throws Failure if the signal
/// cannot be sent.
[[nodiscard]] bool signal_servant(const std::string& name, int signal);

/// Ends the processes by SIGTERM, through their supervisor if they have one, and then by SIGKILL if
/// necessary. Throws Failure if one does not end.
void end_robot(const std::string& name);

}  // namespace corbot::cli
