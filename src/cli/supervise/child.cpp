// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <utility>

#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr std::size_t kMaxLine = 4096;

/// Between fork and exec: only async-signal-safe calls. Writes errno to `report` when exec fails.
[[noreturn]] void exec_child(char* const* argv, int output, int report, pid_t supervisor) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != supervisor) ::_exit(127);  // it died before the line above
  ::dup2(output, STDOUT_FILENO);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execvp(argv[0], argv);
  const int error = errno;
  (void)!::write(report, &error, sizeof(error));
  ::_exit(127);
}

}  // namespace

std::string beside_executable(const std::string& program) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto path = self.parent_path() / program;
  return !error && ::access(path.c_str(), X_OK) == 0 ? path.string() : program;
}

std::optional<std::string> find_program(const std::string& program) {
  const std::string beside = beside_executable(program);
  if (beside.find('/') != std::string::npos) return beside;
  const char* path = std::getenv("PATH");
  std::istringstream directories(path != nullptr ? path : "");
  for (std::string directory; std::getline(directories, directory, ':');) {
    const std::string file = fmt::format("{}/{}", directory, program);
    if (::access(file.c_str(), X_OK) == 0) return file;
  }
  return std::nullopt;
}

std::string describe_end(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    return fmt::format("signal {} ({})", WTERMSIG(wait_status), ::strsignal(WTERMSIG(wait_status)));
  }
  return fmt::format("exit code {}", WEXITSTATUS(wait_status));
}

Child::Child(std::string title, std::vector<std::string> command)
    : title_(std::move(title)), command_(std::move(command)) {}

Child::Child(Child&& other) noexcept
    : title_(std::move(other.title_)),
      command_(std::move(other.command_)),
      pid_(std::exchange(other.pid_, 0)),
      output_fd_(std::exchange(other.output_fd_, -1)),
      partial_(std::move(other.partial_)),
      started_(other.started_) {}

Child::~Child() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  close_output();
}

void Child::close_output() {
  if (output_fd_ >= 0) ::close(output_fd_);
  output_fd_ = -1;
}

void Child::start() {
  std::array<int, 2> output{};
  std::array<int, 2> report{};
  if (::pipe2(output.data(), O_CLOEXEC) != 0 || ::pipe2(report.data(), O_CLOEXEC) != 0) {
    throw Failure(ExitCode::kInternal, fmt::format("pipe: {}", std::strerror(errno)));
  }
  std::vector<char*> argv;
  for (auto& word : command_) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t self = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) exec_child(argv.data(), output[1], report[1], self);
  const int fork_error = errno;
  ::close(output[1]);
  ::close(report[1]);
  int error = pid < 0 ? fork_error : 0;
  if (pid > 0) (void)!::read(report[0], &error, sizeof(error));  // end of file once exec has succeeded
  ::close(report[0]);
  if (error != 0) {
    ::close(output[0]);
    if (pid > 0) ::waitpid(pid, nullptr, 0);
    throw Failure(ExitCode::kInternal,
                  fmt::format("cannot start {}: {}: {}; is the installation of corbot complete?", title_,
                              command_[0], std::strerror(error)));
  }
  close_output();
  ::fcntl(output[0], F_SETFL, O_NONBLOCK);
  pid_ = pid;
  output_fd_ = output[0];
  partial_.clear();
  started_ = Clock::now();
}

std::vector<std::string> Child::read_lines() {
  std::vector<std::string> lines;
  std::array<char, 4096> buffer{};
  while (output_fd_ >= 0) {
    const ssize_t n = ::read(output_fd_, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) break;
    if (n <= 0) {
      close_output();
      break;
    }
    partial_.append(buffer.data(), static_cast<std::size_t>(n));
    for (std::size_t end = partial_.find('\n'); end != std::string::npos; end = partial_.find('\n')) {
      lines.push_back(partial_.substr(0, end));
      partial_.erase(0, end + 1);
    }
    if (partial_.size() > kMaxLine) partial_.clear();
  }
  return lines;
}

std::optional<int> Child::reap() {
  int status = 0;
  if (pid_ <= 0 || ::waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  pid_ = 0;
  return status;
}

void Child::send(int signal) const {
  if (pid_ > 0) ::kill(pid_, signal);
}

}  // namespace corbot::cli
