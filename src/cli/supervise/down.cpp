// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "cli/supervise/state_lock.h"
#include "cli/supervise/up.h"
#include "client/client.h"
#include "client/explain.h"
#include "client/failure.h"
#include "config/profile.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::is_up;
using client::read_state;
using client::robots_up;
using client::supervisor_of;

namespace {

/// Three children with five seconds each before they are killed, plus a margin.
constexpr int kShutdownTimeout_ms = 20'000;

/// Returns the robot by `option` (the value of --robot), $CORBOT_ROBOT, or the only one that is up.
std::string robot_meant(const std::string& option) {
  const char* const environment = std::getenv("CORBOT_ROBOT");
  std::string given = !option.empty() ? option : environment != nullptr ? environment : "";
  if (is_name(given)) return given;
  if (!given.empty()) {
    std::string local = client::find_robot(given).local;
    if (!local.empty()) return local;
    throw Failure(ExitCode::kUsage, fmt::format("{} names no robot that 'corbot up' supervises on this "
                                                "machine: name one with --name; nothing was ended",
                                                option.empty() ? "$CORBOT_ROBOT" : "--robot"));
  }
  const auto names = robots_up();
  if (names.size() == 1) return names[0];
  if (names.empty()) {
    std::string text =
        fmt::format("no robot is up on this machine ({}): nothing to end", client::where_looked());
    for (const std::string& name : stale_robots())
      text += fmt::format("; stale after a crash: {0}: 'corbot down --name {0}'", name);
    throw Failure(ExitCode::kUnreachable, text);
  }
  throw Failure(ExitCode::kUsage, fmt::format("{} robots are up: name one with --name {}", names.size(),
                                              fmt::join(names, " | ")));
}

/// Sends SIGTERM to the supervisor and waits for its end. With a pidfd the signal cannot reach another
/// process that has reused the pid, if the pid holds the lock after the pidfd was opened.
void end_supervisor(const std::string& name, pid_t pid) {
  const int fd = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  if (fd < 0) {
    if (errno == ESRCH) return;
    throw Failure(ExitCode::kInternal, fmt::format("process {}: {}", pid, std::strerror(errno)));
  }
  if (supervisor_of(name) != pid) {
    ::close(fd);
    return;
  }
  const long sent = ::syscall(SYS_pidfd_send_signal, fd, SIGTERM, nullptr, 0);
  const int error = errno;
  pollfd end{fd, POLLIN, 0};
  const int ended = sent == 0 ? ::poll(&end, 1, kShutdownTimeout_ms) : 0;
  ::close(fd);
  if (sent != 0 && error != ESRCH) {
    throw Failure(ExitCode::kInternal, fmt::format("process {}: {}", pid, std::strerror(error)));
  }
  if (ended == 0) {
    throw Failure(ExitCode::kInternal, fmt::format("the supervisor of '{}' (pid {}) does not end: 'kill -9 "
                                                   "{}' kills the supervisor and its children",
                                                   name, pid, pid));
  }
}

/// Returns true if the robot stays up. A command that removes stale files also holds the lock for an instant.
bool is_up_still(const std::string& name) {
  for (int look = 0; look < 20; ++look) {
    if (!is_up(name)) return false;
    ::usleep(10'000);
  }
  return true;
}

}  // namespace

void down(const std::string& wanted, const std::string& robot) {
  const std::string name = wanted.empty() ? robot_meant(robot) : wanted;
  if (!is_name(name)) {
    throw Failure(ExitCode::kUsage, fmt::format("--name '{}': {}", client::printable(name), name_rule()));
  }
  if (!is_up(name)) {
    if (!remove_stale(name)) {
      throw Failure(ExitCode::kUnreachable,
                    fmt::format("no robot named '{}' is up on this machine ({}){}", name,
                                client::where_looked(name), client::robots_up_instead(name)));
    }
    fmt::print("{} was not up; its stale files are removed\n", name);
    return;
  }
  const auto state = read_state(name);
  if (!state)
    throw Failure(ExitCode::kInternal, fmt::format("'{}' is just starting: try again in a moment", name));
  const auto supervisor = supervisor_of(name);
  if (!supervisor && is_up(name)) {
    throw Failure(
        ExitCode::kInternal,
        fmt::format("'{}' is up, but its process is not visible from here (another container?); nothing was "
                    "ended",
                    name));
  }
  if (supervisor) end_supervisor(name, *supervisor);
  if (is_up_still(name)) {
    throw Failure(
        ExitCode::kInternal,
        fmt::format("'{}' is still up, or up again: another 'corbot up' has started a robot of this name",
                    name));
  }
  remove_stale(name);
  fmt::print("{} is down\n", name);
}

}  // namespace corbot::cli
