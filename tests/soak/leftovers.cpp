// SPDX-License-Identifier: Apache-2.0
#include "soak/leftovers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "soak/stall_watch.h"
#include "support/process.h"

namespace corbot::soak {
namespace {

namespace fs = std::filesystem;

/// A client that is killed and a `corbot status` that ends leave connections for a while: the servant finds
/// them closed within a second, and silent ones within ten. An idle thread of an ORB ends after as long.
constexpr double kSettled_s = 20.0;
/// The growth that is allowed. The clients are other ones than at the first count, each with one connection
/// more or less. The supervisor's store holds one or two segments of a restarted task.
constexpr int kTolerance = 5;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

int entries_in(const fs::path& path) {
  std::error_code gone;
  fs::directory_iterator all(path, gone);
  return gone ? 0 : static_cast<int>(std::distance(begin(all), end(all)));
}

/// With this in their environment, this process excepted.
std::string processes_with(const std::string& variable) {
  std::string found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos || name == std::to_string(::getpid()))
      continue;
    const std::string environment = text_of(entry.path() / "environ");
    if (environment.find(variable) == std::string::npos) continue;
    std::string command = text_of(entry.path() / "cmdline");
    std::replace(command.begin(), command.end(), '\0', ' ');
    found += fmt::format("process {}: {}\n", name, command);
  }
  return found;
}

std::string lines_with(const char* file, const std::string& text, const char* what) {
  std::istringstream lines(text_of(file));
  std::string found;
  for (std::string line; std::getline(lines, line);) {
    if (line.find(text) != std::string::npos) found += fmt::format("{}: {}\n", what, line);
  }
  return found;
}

std::string files_named(const std::string& robot, const fs::path& directory, const std::string& scratch) {
  constexpr int kDeepest = 3;
  std::string found;
  std::error_code denied;
  fs::recursive_directory_iterator all(directory, fs::directory_options::skip_permission_denied, denied);
  for (; !denied && all != fs::recursive_directory_iterator(); all.increment(denied)) {
    if (all->path() == scratch || all.depth() >= kDeepest) all.disable_recursion_pending();
    if (all->path().filename().string().find(robot) != std::string::npos &&
        !all->path().string().starts_with(scratch + "/"))
      found += fmt::format("file {}\n", all->path().string());
  }
  return found;
}

}  // namespace

Holdings holdings_of(pid_t pid) {
  const fs::path process = fs::path("/proc") / std::to_string(pid);
  return {entries_in(process / "fd"), entries_in(process / "task")};
}

std::string RestCheck::look(const std::function<std::map<std::string, pid_t>()>& processes) {
  const bool is_first = looks_++ == 0;
  std::string faults;
  const auto compare = [&] {
    faults.clear();
    for (const auto& [name, pid] : processes()) {
      const Holdings now = holdings_of(pid);
      if (now.descriptors == 0) faults += fmt::format("no {}\n", name);
      const auto first = first_.find(name);
      if (first == first_.end()) continue;
      if (now.descriptors > first->second.descriptors + kTolerance ||
          now.threads > first->second.threads + kTolerance)
        faults +=
            fmt::format("{} holds {} descriptors and {} threads at rest, {} and {} in the beginning\n", name,
                        now.descriptors, now.threads, first->second.descriptors, first->second.threads);
    }
    return faults.empty();
  };
  (void)test::wait_until(test::within(kSettled_s), compare);
  for (const auto& [name, pid] : processes()) {
    const Holdings now = holdings_of(pid);
    if (is_first) first_[name] = now;
    Holdings& most = most_[name];
    most = {std::max(most.descriptors, now.descriptors), std::max(most.threads, now.threads)};
  }
  return faults;
}

std::string RestCheck::summary() const {
  std::string text = fmt::format("{} looks at rest;", looks_);
  for (const auto& [name, most] : most_) {
    const Holdings& first = first_.at(name);
    text += fmt::format(" {}: {} descriptors and {} threads at first, {} and {} at most;", name,
                        first.descriptors, first.threads, most.descriptors, most.threads);
  }
  return text;
}

std::string leftovers(const std::string& robot, const std::string& scratch, int port) {
  std::string processes;
  // The kernel's signals at a supervisor's death take a moment.
  (void)test::wait_until(test::within(kSettled_s), [&] {
    return (processes = processes_with("XDG_RUNTIME_DIR=" + scratch + std::string(1, '\0'))).empty();
  });
  std::string left = processes;
  left += lines_with("/proc/net/unix", robot, "Unix socket");
  left += lines_with("/proc/net/unix", scratch, "Unix socket");
  // State 0A: listening.
  left += lines_with("/proc/net/tcp", fmt::format(":{:04X} 00000000:0000 0A", port), "listening");
  const char* const home = std::getenv("HOME");
  for (const fs::path& directory :
       {fs::path("/dev/shm"), fs::path("/tmp"), fs::path("/run/user") / std::to_string(::getuid()),
        fs::path(home != nullptr ? home : "/nonexistent") / ".local/state"}) {
    left += files_named(robot, directory, scratch);
  }
  return left;
}

}  // namespace corbot::soak
