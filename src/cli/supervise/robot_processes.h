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

/// Those of this user that live, the servants first; wherever their supervisor keeps its files.
[[nodiscard]] std::vector<RobotProcess> find_robot_processes(const std::string& name);

/// "corbot up (pid 12)" or "corbot-rt (pid 13), corbot-servant (pid 14)".
[[nodiscard]] std::string describe(const std::vector<RobotProcess>& processes);

/// Sends a signal to its servant. False where this user has none. Throws Failure when it cannot be sent.
[[nodiscard]] bool signal_servant(const std::string& name, int signal);

/// Ends them by SIGTERM, through their supervisor where they have one; by SIGKILL what has not ended after
/// that. Throws Failure for one that does not end.
void end_robot(const std::string& name);

}  // namespace corbot::cli
