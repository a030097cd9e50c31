// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

// The commands of one user find the robots that are up on this machine by one file for each robot, which its
// supervisor writes. NAME.lock lies beside NAME.json; the supervisor holds its lock while it lives. The
// kernel releases the lock at any end of the process, so a stale file never counts as a live robot. The file
// has two locks: flock(2)'s shows whether the supervisor lives, and a record lock of fcntl(2) shows its pid.

namespace corbot::client {

struct RobotState {
  std::string name;
  pid_t pid{};                   ///< pid of the supervisor, for people; supervisor_of() is reliable
  std::string profile;           ///< absolute path
  std::string profile_in_use{};  ///< a copy from the start, which the processes read
  std::string endpoint;          ///< HOST:PORT
  std::string address;           ///< corbaloc URI that the servant printed
  std::string orb;
  pid_t rt_pid{};
  pid_t servant_pid{};
  std::string naming;  ///< corbaloc of the naming service that was started, or empty
};

/// Returns user_run_directory(). Creates it if `create`. Throws Failure if it belongs to another user or
/// others can access it.
[[nodiscard]] std::filesystem::path state_directory(bool create);

/// Returns the state as the supervisor last wrote it, alive or not, or nothing if there is no such file.
[[nodiscard]] std::optional<RobotState> read_state(const std::string& name);

/// Returns text for messages, for one name or all: "'lynx5' is up with its files in DIRECTORY…" if this user
/// has robots under another XDG_RUNTIME_DIR, else "". `naming` is that of find_robot().
[[nodiscard]] std::string robots_elsewhere(const std::string& name = "",
                                           const std::string& naming = "--robot");
/// Returns "looked in DIRECTORY" followed by robots_elsewhere().
[[nodiscard]] std::string where_looked(const std::string& name = "", const std::string& naming = "--robot");

/// Returns true if a supervisor of that robot lives.
[[nodiscard]] bool is_up(const std::string& name);

/// Returns the supervisor of that robot: the process that holds the record lock according to the kernel,
/// whatever the state file contains. Returns nothing if no process holds it or the process is in another pid
/// namespace.
[[nodiscard]] std::optional<pid_t> supervisor_of(const std::string& name);

/// Returns the names of the robots that are up, sorted.
[[nodiscard]] std::vector<std::string> robots_up();

/// Returns text for messages: "; these are up: lynx5, puma560; did you mean 'lynx5'?" if robots other than
/// `name` are up, else "".
[[nodiscard]] std::string robots_up_instead(const std::string& name);

/// Returns "'lynx5' is up at 127.0.0.1:12810" for the robot here that listens at that port, else "".
[[nodiscard]] std::string robot_at_port(int port);

/// Returns the name of the robot here that listens at HOST:PORT. Returns "" if there is none, or the files
/// cannot be read.
[[nodiscard]] std::string robot_at(std::string where);

/// Returns why no server can listen there, with the robot that uses the port if there is one; "" if a server
/// can.
[[nodiscard]] std::string endpoint_fault(const std::string& host, int port);

/// Returns the open lock file of a robot, or −1 with errno. `flags`: those of open(2).
[[nodiscard]] int open_lock(const std::filesystem::path& directory, const std::string& name, int flags);

/// Returns the names of the robots that have a state file and are not up, sorted.
[[nodiscard]] std::vector<std::string> robots_with_stale_state();

}  // namespace corbot::client
