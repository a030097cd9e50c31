// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/robot_processes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "client/failure.h"
#include "shm/descriptor.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

namespace fs = std::filesystem;

constexpr int kEndWithin_ms = 20'000;  // a supervisor ends three children in five seconds each at most
constexpr int kDieWithin_ms = 5'000;

/// Returns the file name of a process's program, or "" if the process is not this user's.
std::string program_of(pid_t pid) {
  std::error_code error;
  std::string file = fs::read_symlink(fmt::format("/proc/{}/exe", pid), error).filename().string();
  constexpr std::string_view kReplaced = " (deleted)";  // after an upgrade of the program
  if (file.ends_with(kReplaced)) file.resize(file.size() - kReplaced.size());
  return error ? "" : file;
}

pid_t parent_of(pid_t pid) {
  std::ifstream stream(fmt::format("/proc/{}/stat", pid));
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::size_t name_end = text.rfind(')');  // the name before may contain anything
  if (name_end == std::string::npos) return 0;
  std::istringstream rest(text.substr(name_end + 1));
  std::string state;
  pid_t parent = 0;
  rest >> state >> parent;
  return parent;
}

/// Returns true if the process holds a descriptor of that robot's shared memory.
bool holds_memory_of(pid_t pid, const std::string& name) {
  const std::string memfd = fmt::format("/memfd:corbot.{} (deleted)", name);
  std::error_code error;
  for (fs::directory_iterator entry(fmt::format("/proc/{}/fd", pid), error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code gone;
    const std::string target = fs::read_symlink(entry->path(), gone).string();
    if (!gone && target == memfd) return true;
  }
  return false;
}

/// Sends a signal through a pidfd, so that it hits no other process with that pid. Returns the pidfd, or none
/// if the process has ended. Throws Failure.
Descriptor signal_process(pid_t pid, const std::string& program, int signal) {
  Descriptor fd(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  if (fd.get() < 0 || program_of(pid) != program) return {};
  if (::syscall(SYS_pidfd_send_signal, fd.get(), signal, nullptr, 0) == 0) return fd;
  if (errno == ESRCH) return {};
  throw Failure(ExitCode::kInternal, fmt::format("{} (pid {}): {}", program, pid, std::strerror(errno)));
}

/// Sends the signal and waits for the end.
bool end_process(pid_t pid, const std::string& program, int signal, int within_ms) {
  const Descriptor fd = signal_process(pid, program, signal);
  pollfd end{fd.get(), POLLIN, 0};
  return !fd || ::poll(&end, 1, within_ms) == 1;
}

}  // namespace

std::vector<RobotProcess> find_robot_processes(const std::string& name) {
  std::vector<RobotProcess> found;
  std::error_code error;
  for (fs::directory_iterator entry("/proc", error), end; !error && entry != end; entry.increment(error)) {
    const std::string text = entry->path().filename().string();
    pid_t pid = 0;
    if (std::from_chars(text.data(), text.data() + text.size(), pid).ptr != text.data() + text.size())
      continue;
    const std::string program = program_of(pid);
    const bool is_servant = program.starts_with("corbot-servant");
    if ((!is_servant && program != "corbot-rt") || !holds_memory_of(pid, name)) continue;
    const pid_t parent = parent_of(pid);
    found.insert(is_servant ? found.begin() : found.end(),
                 {pid, program, program_of(parent) == "corbot" ? parent : 0});
  }
  return found;
}

std::string describe(const std::vector<RobotProcess>& processes) {
  std::vector<std::string> texts;
  for (const RobotProcess& process : processes) {
    const std::string text = process.supervisor > 0
                                 ? fmt::format("corbot up (pid {})", process.supervisor)
                                 : fmt::format("{} (pid {})", process.program, process.pid);
    if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

bool signal_servant(const std::string& name, int signal) {
  for (const RobotProcess& process : find_robot_processes(name)) {
    if (process.program != "corbot-rt" && signal_process(process.pid, process.program, signal)) return true;
  }
  return false;
}

void end_robot(const std::string& name) {
  std::set<pid_t> ended;
  for (const RobotProcess& process : find_robot_processes(name)) {
    const pid_t pid = process.supervisor > 0 ? process.supervisor : process.pid;
    const std::string program = process.supervisor > 0 ? "corbot" : process.program;
    if (!ended.insert(pid).second) continue;
    if (!end_process(pid, program, SIGTERM, kEndWithin_ms))
      (void)end_process(pid, program, SIGKILL, kDieWithin_ms);
  }
  for (const RobotProcess& process : find_robot_processes(name)) {  // their supervisor had to be killed
    if (!end_process(process.pid, process.program, SIGKILL, kDieWithin_ms)) {
      throw Failure(ExitCode::kInternal, fmt::format("{} does not end, even by SIGKILL, because it waits in "
                                                     "the kernel for a device: unplug the device",
                                                     describe({process})));
    }
  }
}

}  // namespace corbot::cli
