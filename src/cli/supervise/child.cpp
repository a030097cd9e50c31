// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr std::size_t kMaxLine = 4096;

/// The environment of a child, without the variables that an outer supervisor set for this process.
class ChildEnvironment {
 public:
  explicit ChildEnvironment(const Service& service) : errors_too_(service.errors_too) {
    constexpr std::array<std::string_view, 6> kOwn{
        "NOTIFY_SOCKET=", "WATCHDOG_USEC=", "WATCHDOG_PID=", "LISTEN_FDS=", "LISTEN_PID=", "LISTEN_FDNAMES="};
    for (char** entry = environ; *entry != nullptr; ++entry) {
      const std::string_view text(*entry);
      if (std::none_of(kOwn.begin(), kOwn.end(), [&](auto own) { return text.starts_with(own); }))
        entries_.emplace_back(text);
    }
    if (!service.notify_socket.empty()) entries_.push_back("NOTIFY_SOCKET=" + service.notify_socket);
    if (service.watchdog_s > 0) {
      entries_.push_back(fmt::format("WATCHDOG_USEC={}", std::llround(service.watchdog_s * 1e6)));
      watchdog_pid_ = add_pid("WATCHDOG_PID=");
    }
    if (service.stored != nullptr && !service.stored->items().empty()) {
      for (const auto& item : service.stored->items()) passed_.push_back(item.fd.get());
      entries_.push_back(fmt::format("LISTEN_FDS={}", passed_.size()));
      entries_.push_back("LISTEN_FDNAMES=" + service.stored->names());
      listen_pid_ = add_pid("LISTEN_PID=");
    }
    for (std::string& entry : entries_) pointers_.push_back(entry.data());
    pointers_.push_back(nullptr);
    if (watchdog_pid_ != kNone) watchdog_digits_ = digits(watchdog_pid_);
    if (listen_pid_ != kNone) listen_digits_ = digits(listen_pid_);
  }
  ChildEnvironment(const ChildEnvironment&) = delete;
  ChildEnvironment& operator=(const ChildEnvironment&) = delete;

  [[nodiscard]] bool errors_too() const noexcept { return errors_too_; }

  /// Writes the pid, and places the descriptors from 3 on. Called in the child, between fork and exec.
  char* const* enter() noexcept {
    write_pid(watchdog_digits_);
    write_pid(listen_digits_);
    int at = DescriptorStore::kFirstPassed;
    for (const int fd : passed_) ::dup2(fd, at++);  // also clears close-on-exec
    return pointers_.data();
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  static constexpr std::size_t kDigits = 10;

  std::size_t add_pid(const char* key) {
    entries_.push_back(key + std::string(kDigits, ' '));
    return entries_.size() - 1;
  }
  char* digits(std::size_t entry) {
    std::string& text = entries_[entry];
    return text.data() + text.size() - kDigits;
  }
  static void write_pid(char* at) noexcept {
    if (at == nullptr) return;
    std::array<char, kDigits> reversed{};
    std::size_t count = 0;
    for (auto rest = static_cast<unsigned>(::getpid()); rest != 0; rest /= 10)
      reversed[count++] = static_cast<char>('0' + rest % 10);
    for (std::size_t i = 0; i < count; ++i) at[i] = reversed[count - 1 - i];
    at[count] = '\0';  // with kDigits digits this is the string's own end
  }

  bool errors_too_;
  std::vector<std::string> entries_;
  std::vector<char*> pointers_;
  std::vector<int> passed_;
  std::size_t watchdog_pid_{kNone};
  std::size_t listen_pid_{kNone};
  char* watchdog_digits_{nullptr};
  char* listen_digits_{nullptr};
};

/// Runs between fork and exec: only async-signal-safe calls. Writes errno to `report` if exec fails.
[[noreturn]] void exec_child(char* const* argv, ChildEnvironment& environment, int output, int report,
                             pid_t supervisor) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != supervisor) ::_exit(127);  // the supervisor died before the line above
  ::dup2(output, STDOUT_FILENO);
  if (environment.errors_too()) ::dup2(output, STDERR_FILENO);
  char* const* const entries = environment.enter();
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execvpe(argv[0], argv, entries);
  const int error = errno;
  (void)!::write(report, &error, sizeof(error));
  ::_exit(127);
}

/// Opens a pipe whose two ends are above the descriptors that a child receives.
std::array<Descriptor, 2> open_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Failure(ExitCode::kInternal, fmt::format("pipe: {}", std::strerror(errno)));
  std::array<Descriptor, 2> out{above_passed(Descriptor(ends[0])), above_passed(Descriptor(ends[1]))};
  if (out[0].get() < 0 || out[1].get() < 0)
    throw Failure(ExitCode::kInternal, fmt::format("pipe: {}", std::strerror(errno)));
  return out;
}

}  // namespace

std::string beside_executable(const std::string& program) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto path = self.parent_path() / program;
  return !error && ::access(path.c_str(), X_OK) == 0 ? path.string() : program;
}

std::optional<std::string> find_program(const std::string& program) {
  std::string beside = beside_executable(program);
  if (beside.find('/') != std::string::npos) return beside;
  const char* path = std::getenv("PATH");
  std::istringstream directories(path != nullptr ? path : "");
  for (std::string directory; std::getline(directories, directory, ':');) {
    std::string file = fmt::format("{}/{}", directory, program);
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

void Child::start(const Service& service, const std::vector<std::string>& more) {
  auto [output, child_output] = open_pipe();
  auto [report, child_report] = open_pipe();
  std::vector<std::string> command = command_;
  command.insert(command.end(), more.begin(), more.end());
  std::vector<char*> argv;
  for (auto& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  ChildEnvironment environment(service);
  const pid_t self = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) exec_child(argv.data(), environment, child_output.get(), child_report.get(), self);
  const int fork_error = errno;
  child_output = {};
  child_report = {};
  int error = pid < 0 ? fork_error : 0;
  if (pid > 0) (void)!::read(report.get(), &error, sizeof(error));  // end of file if exec has succeeded
  if (error != 0) {
    if (pid > 0) ::waitpid(pid, nullptr, 0);
    throw Failure(ExitCode::kInternal,
                  fmt::format("cannot start {}: {}: {}; is the installation of corbot complete?", title_,
                              command_[0], std::strerror(error)));
  }
  close_output();
  ::fcntl(output.get(), F_SETFL, O_NONBLOCK);
  pid_ = pid;
  output_fd_ = output.release();
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

bool Child::has_ended() const {
  siginfo_t info{};
  return pid_ > 0 && ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == pid_;
}

std::optional<int> Child::reap() {
  int status = 0;
  if (pid_ <= 0 || ::waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  pid_ = 0;
  return status;
}

int Child::wait() {
  int status = 0;
  while (pid_ > 0 && ::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  return status;
}

void Child::send(int signal) const {
  if (pid_ > 0) ::kill(pid_, signal);
}

}  // namespace corbot::cli
