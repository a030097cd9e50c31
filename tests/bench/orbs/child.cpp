// SPDX-License-Identifier: Apache-2.0
#include "orbs/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <stdexcept>

namespace corbot::bench {
namespace {

constexpr int kAnswer_ms = 60'000;  // generous: it only ends a hang
constexpr int kEnd_ms = 10'000;

void become(std::vector<std::string>& command, int input, int output) {
  ::signal(SIGPIPE, SIG_DFL);  // an ORB may have changed it in this process
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  std::vector<char*> argv;
  for (auto& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  ::execv(argv[0], argv.data());
}

/// Whether there is output to read, or its end; false when neither comes within `timeout_ms`.
bool wait_readable(int fd, int timeout_ms) {
  pollfd there{fd, POLLIN, 0};
  int n = -1;
  do {
    n = ::poll(&there, 1, timeout_ms);
  } while (n < 0 && errno == EINTR);
  return n > 0;
}

}  // namespace

Child::Child(std::vector<std::string> command) : program_(std::filesystem::path(command[0]).filename()) {
  int in[2];
  int out[2];
  if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) throw std::runtime_error("pipe2 failed");
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // not SIGKILL: the real-time task has a segment to remove
    if (::getppid() == parent) become(command, in[0], out[1]);
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  input_ = in[1];
  output_ = out[0];
  try {
    if (pid_ < 0) throw std::runtime_error("fork failed");
    const std::string word = "ready";
    std::string line;
    while (!line.starts_with(word)) line = read_line();
    ready_ = line.substr(std::min(line.size(), word.size() + 1));
  } catch (...) {
    end();
    throw;
  }
}

Child::~Child() { end(); }

void Child::end() {
  if (pid_ > 0) ::kill(pid_, SIGTERM);
  ::close(input_);
  bool in_time = wait_readable(output_, kEnd_ms);
  while (in_time && read_more()) in_time = wait_readable(output_, kEnd_ms);
  if (!in_time && pid_ > 0) ::kill(pid_, SIGKILL);
  if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
  ::close(output_);
}

/// False at the end of the output.
bool Child::read_more() {
  char buffer[4096];
  const ssize_t n = ::read(output_, buffer, sizeof(buffer));
  if (n > 0) unread_.append(buffer, static_cast<std::size_t>(n));
  return n > 0;
}

std::string Child::read_line() {
  std::size_t end = unread_.find('\n');
  for (; end == std::string::npos; end = unread_.find('\n')) {
    if (!wait_readable(output_, kAnswer_ms) || !read_more())
      throw std::runtime_error(program_ + " says nothing more");
  }
  std::string line = unread_.substr(0, end);
  unread_.erase(0, end + 1);
  return line;
}

void Child::write_line(const std::string& line) {
  const std::string text = line + "\n";  // short enough for a pipe to take it whole
  if (::write(input_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error(program_ + " is gone");
  }
}

}  // namespace corbot::bench
