// SPDX-License-Identifier: Apache-2.0
#include "cli/stop_all.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <list>
#include <vector>

#include "cli/supervise/child.h"
#include "client/explain.h"
#include "client/failure.h"
#include "client/local_robots.h"
#include "client/notice.h"
#include "shm/run_directory.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::robots_up;

namespace {

/// Returns the supervised robots and those whose task was started by hand.
std::vector<std::string> robots_here() {
  std::vector<std::string> names = robots_up();
  try {
    if (const auto directory = RunDirectory::open(false)) {
      const std::vector<std::string> listening = directory->listening();
      names.insert(names.end(), listening.begin(), listening.end());
    }
  } catch (const SegmentError& error) {
    client::notice(stderr, fmt::format("corbot: {}\n", error.what()));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

struct Stopping {
  std::string robot;
  Child child;
  std::string last_line{};
};

/// Reads the output of the process until its end.
void read_to_end(Stopping& stopping) {
  while (stopping.child.output_fd() >= 0) {
    pollfd output{stopping.child.output_fd(), POLLIN, 0};
    (void)::poll(&output, 1, -1);
    for (std::string& line : stopping.child.read_lines()) stopping.last_line = std::move(line);
  }
}

/// Prints the result; returns true if the robot has stopped.
bool report_stop(Stopping& stopping) {
  read_to_end(stopping);
  const int status = stopping.child.wait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    client::notice(stdout, fmt::format("{}: stopped\n", stopping.robot));
    return true;
  }
  constexpr std::string_view kPrefix = "corbot: ";
  std::string why = stopping.last_line.empty() ? describe_end(status) : stopping.last_line;
  if (why.starts_with(kPrefix)) why.erase(0, kPrefix.size());
  client::notice(stdout, fmt::format("{}: NOT STOPPED: {}\n", stopping.robot, client::printable(why)));
  return false;
}

}  // namespace

void stop_all(const std::string& robot, double timeout_s) {
  if (!robot.empty()) throw Failure(ExitCode::kUsage, "stop: give either --all or --robot, not both");
  const auto names = robots_here();
  if (names.empty()) {
    throw Failure(ExitCode::kUnreachable, fmt::format("no robot is up on this machine ({}): nothing to stop",
                                                      client::where_looked()));
  }
  std::list<Stopping> all;
  for (const std::string& name : names) {
    const std::vector<std::string> command{
        "/proc/self/exe", "stop", "--robot", name, "--timeout", fmt::format("{}", timeout_s)};
    all.push_back({name, Child("corbot stop", command)});
    all.back().child.start({.errors_too = true});
  }
  std::vector<std::string> failed;
  for (Stopping& stopping : all) {
    if (!report_stop(stopping)) failed.push_back(stopping.robot);
  }
  std::fflush(stdout);
  const std::string elsewhere = client::robots_elsewhere();
  if (!failed.empty()) {
    if (!elsewhere.empty())
      client::notice(stderr, fmt::format("corbot: not stopped by --all: {}\n", elsewhere));
    throw Failure(ExitCode::kUnreachable, fmt::format("{} of {} robots did not confirm the stop: {}",
                                                      failed.size(), names.size(), fmt::join(failed, ", ")));
  }
  if (!elsewhere.empty()) throw Failure(ExitCode::kUnreachable, "not stopped by --all: " + elsewhere);
}

}  // namespace corbot::cli
