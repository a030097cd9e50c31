// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

// How the commands of one user find the robots that are up on this machine: one file a robot, written by its
// supervisor. Beside NAME.json lies NAME.lock, whose lock the supervisor holds while it lives; the kernel
// releases it however it dies, so a stale file is never taken for a live robot. The file has two locks: flock(2)'s
// tells whether it lives, and a record lock of fcntl(2) who it is.

namespace corbot::client {

struct RobotState {
  std::string name;
  pid_t pid{};                   ///< of the supervisor, for people; supervisor_of() is to be trusted
  std::string profile;           ///< absolute path
  std::string profile_in_use{};  ///< a copy of it from the start, which the processes read
  std::string endpoint;          ///< HOST:PORT
  std::string address;           ///< corbaloc URI as the servant printed it
  std::string orb;
  pid_t rt_pid{};
  pid_t servant_pid{};
  std::string naming;  ///< corbaloc of the naming service that was started, or empty
};

/// user_run_directory(). Created if `create`; throws Failure when it belongs to another user or is open to others.
[[nodiscard]] std::filesystem::path state_directory(bool create);

/// The state as the supervisor last wrote it, whether it lives or not; nothing when there is no such file.
[[nodiscard]] std::optional<RobotState> read_state(const std::string& name);

/// For messages, of one name or all: "'lynx5' is up with its files in DIRECTORY…" where this user has them under another
/// XDG_RUNTIME_DIR; empty: none.
[[nodiscard]] std::string robots_elsewhere(const std::string& name = "");
/// "looked in DIRECTORY", and that.
[[nodiscard]] std::string where_looked(const std::string& name = "");

/// Does a supervisor of that robot live?
[[nodiscard]] bool is_up(const std::string& name);

/// The supervisor of that robot, as the kernel names the process that holds the lock's record, whatever is written in
/// the state file; nothing when none holds it or it is in another pid namespace.
[[nodiscard]] std::optional<pid_t> supervisor_of(const std::string& name);

/// Names of the robots that are up, sorted.
[[nodiscard]] std::vector<std::string> robots_up();

/// For messages: ", but lynx5, puma560: did you mean 'lynx5'?" where other robots are up than `name`; empty: none is.
[[nodiscard]] std::string robots_up_instead(const std::string& name);

/// "'lynx5' is up at 127.0.0.1:12810": the robot here that listens at that port; empty: none does.
[[nodiscard]] std::string robot_at_port(int port);

/// Name of the robot here that listens at HOST:PORT; empty: none does, or the files cannot be read.
[[nodiscard]] std::string robot_at(std::string where);

/// Why nothing can listen there, with the robot that has the port where one has it; empty: something can.
[[nodiscard]] std::string endpoint_fault(const std::string& host, int port);

/// The open lock file of a robot, or −1 with errno. `flags`: those of open(2).
[[nodiscard]] int open_lock(const std::filesystem::path& directory, const std::string& name, int flags);

/// Names of the robots that have a state file and are not up, sorted.
[[nodiscard]] std::vector<std::string> robots_with_stale_state();

}  // namespace corbot::client
