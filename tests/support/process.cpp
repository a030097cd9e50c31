// SPDX-License-Identifier: Apache-2.0
#include "support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "support/scratch.h"

namespace corbot::test {

namespace {

/// Reads what is available into `text`; closes `fd` at its end.
void read_available(int& fd, std::string& text) {
  char buffer[4096];
  while (fd >= 0) {
    const ssize_t n = ::read(fd, buffer, sizeof(buffer));
    if (n > 0) {
      text.append(buffer, static_cast<std::size_t>(n));
    } else if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
      return;
    } else {
      ::close(fd);
      fd = -1;
    }
  }
}

/// The state directory of the children of this test, beside its program or in CORBOT_SCRATCH. Its end removes
/// it.
class StateDirectory {
 public:
  StateDirectory()
      : variable_("CORBOT_STATE_DIR=" + (std::filesystem::path(scratch_directory(
                                             std::filesystem::read_symlink("/proc/self/exe").parent_path())) /
                                         ("state-" + std::to_string(::getpid())))
                                            .string()) {}
  StateDirectory(const StateDirectory&) = delete;
  StateDirectory& operator=(const StateDirectory&) = delete;
  ~StateDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(variable_.substr(variable_.find('=') + 1), ignored);
  }
  [[nodiscard]] const std::string& variable() const { return variable_; }

 private:
  std::string variable_;
};

const std::string& state_variable() {
  static const StateDirectory directory;
  return directory.variable();
}

}  // namespace

Process::Process(std::vector<std::string> command, const std::vector<std::string>& environment) {
  int in[2];
  int out[2];
  int err[2];
  if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0)
    throw std::runtime_error("pipe2 failed");
  std::vector<char*> argv;
  for (auto& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::vector<std::string> variables(environment);
  variables.push_back(state_variable());
  const std::size_t given = variables.size();
  for (char** e = environ; *e != nullptr; ++e) {
    const std::string variable(*e);
    const std::string name = variable.substr(0, variable.find('=') + 1);
    if (std::none_of(variables.begin(), variables.begin() + given,
                     [&](const std::string& v) { return v.starts_with(name); })) {
      variables.push_back(variable);
    }
  }
  std::vector<char*> envp;
  for (auto& variable : variables) envp.push_back(variable.data());
  envp.push_back(nullptr);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(126);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    ::dup2(in[0], STDIN_FILENO);
    ::execvpe(argv[0], argv.data(), envp.data());
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  ::close(err[1]);
  in_ = in[1];
  out_ = out[0];
  err_ = err[0];
  ::fcntl(out_, F_SETFL, O_NONBLOCK);
  ::fcntl(err_, F_SETFL, O_NONBLOCK);
}

Process::Process(Process&& other) noexcept { *this = std::move(other); }

Process& Process::operator=(Process&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(in_, other.in_);
  std::swap(out_, other.out_);
  std::swap(err_, other.err_);
  std::swap(status_, other.status_);
  std::swap(out_text_, other.out_text_);
  std::swap(err_text_, other.err_text_);
  std::swap(line_begin_, other.line_begin_);
  return *this;
}

Process::~Process() {
  if (pid_ > 0 && !status_) {
    ::kill(pid_, SIGTERM);
    if (!wait(within(5))) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }
  if (in_ >= 0) ::close(in_);
  if (out_ >= 0) ::close(out_);
  if (err_ >= 0) ::close(err_);
}

void Process::drain() {
  read_available(out_, out_text_);
  read_available(err_, err_text_);
}

bool Process::running() {
  drain();
  return pid_ > 0 && !status_ && !wait(within(0));
}

std::optional<std::string> Process::wait_line(const std::string& prefix, Deadline deadline) {
  for (;;) {
    drain();
    for (auto end = out_text_.find('\n', line_begin_); end != std::string::npos;
         end = out_text_.find('\n', line_begin_)) {
      std::string line = out_text_.substr(line_begin_, end - line_begin_);
      line_begin_ = end + 1;
      if (line.starts_with(prefix)) return line;
    }
    if (out_ < 0 || std::chrono::steady_clock::now() > deadline) return std::nullopt;
    pollfd both[2] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};
    ::poll(both, 2, 20);
  }
}

long Process::anonymous_kb() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("RssAnon:")) return std::stol(line.substr(8));
  }
  return -1;
}

void Process::send(const std::string& line) {
  const std::string text = line + "\n";
  ::signal(SIGPIPE, SIG_IGN);  // the end of a child is noticed when its output is awaited
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(in_, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return;
    done += static_cast<std::size_t>(n);
  }
}

void Process::signal(int number) const {
  if (pid_ <= 0 || status_ || ::kill(pid_, number) != 0 || number != SIGSTOP) return;
  // Its threads on other processors run on for a moment.
  siginfo_t stopped{};
  wait_until(within(5), [&] {
    const int kind = WSTOPPED | WNOWAIT | WNOHANG;
    return ::waitid(P_PID, static_cast<id_t>(pid_), &stopped, kind) != 0 || stopped.si_pid != 0;
  });
}

void Process::close_input() {
  ::close(in_);
  in_ = -1;
}

void Process::close_errors() {
  drain();
  if (err_ >= 0) ::close(err_);
  err_ = -1;
}

std::optional<int> Process::wait(Deadline deadline) {
  if (pid_ > 0 && !status_) {
    wait_until(deadline, [&] {
      drain();
      int status = 0;
      if (::waitpid(pid_, &status, WNOHANG) != pid_) return false;
      status_ = status;
      return true;
    });
    drain();
  }
  return status_;
}

int Process::terminate() {
  signal(SIGTERM);
  const auto status = wait(within(30));
  if (!status) return -1;
  return WIFEXITED(*status) ? WEXITSTATUS(*status) : 128 + WTERMSIG(*status);
}

const std::string& Process::output() {
  drain();
  return out_text_;
}

const std::string& Process::errors() {
  drain();
  return err_text_;
}

RunResult run(std::vector<std::string> command, double seconds, const std::vector<std::string>& environment) {
  Process process(std::move(command), environment);
  const auto status = process.wait(within(seconds));
  int code = -1;
  if (status) code = WIFEXITED(*status) ? WEXITSTATUS(*status) : 128 + WTERMSIG(*status);
  return {code, process.output(), process.errors()};
}

bool on_orbit2() {
  const char* orb = std::getenv("CORBOT_TEST_ORB");
  return orb != nullptr && std::string(orb) == "orbit2";
}

std::string servant_program(const std::string& directory) {
  return directory + (on_orbit2() ? "/corbot-servant-orbit2" : "/corbot-servant");
}

std::string unique_name(const std::string& stem) {
  static std::atomic<int> count{0};
  return stem + "-" + std::to_string(::getpid()) + "-" + std::to_string(++count);
}

std::string channel_path(const std::string& robot, const std::string& runtime) {
  const char* own = std::getenv("XDG_RUNTIME_DIR");
  const std::string base = !runtime.empty() ? runtime : own != nullptr ? own : "";
  const std::string directory =
      base.empty() ? "/tmp/corbot-" + std::to_string(::geteuid()) : base + "/corbot";
  return directory + "/" + robot + ".sock";
}

bool channel_exists(const std::string& robot, const std::string& runtime) {
  return std::filesystem::exists(channel_path(robot, runtime));
}

}  // namespace corbot::test
