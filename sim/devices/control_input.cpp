// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/control_input.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace corbot::sim {
namespace {

constexpr std::size_t kLongestCommand = 256;

}  // namespace

std::int64_t clock_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void print_line(const std::string& line) { (void)std::fputs((line + "\n").c_str(), stdout); }

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = 0; (begin = text.find_first_not_of(" \t\r", begin)) != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(" \t\r", begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

int ControlInput::fd() const { return is_open_ ? STDIN_FILENO : -1; }

void ControlInput::read(const std::function<std::string(std::string_view)>& handle) {
  std::array<char, 512> text{};
  const ssize_t n = ::read(STDIN_FILENO, text.data(), text.size());
  if (n < 0 && (errno == EINTR || errno == EAGAIN)) return;
  if (n <= 0) {
    is_open_ = false;  // closed; the device goes on
    return;
  }
  text_.append(text.data(), static_cast<std::size_t>(n));
  for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos;) {
    const std::string command = text_.substr(0, end);
    text_.erase(0, end + 1);
    if (std::exchange(is_too_long_, false) || command.size() > kLongestCommand) {
      print_line(fmt::format("error: a line has {} characters at most", kLongestCommand));
    } else if (!words_of(command).empty()) {
      print_line(handle(command));
    }
  }
  if (text_.size() > kLongestCommand) {
    is_too_long_ = true;
    text_.clear();
  }
}

EndingSignals::EndingSignals() {
  sigset_t ending;
  sigemptyset(&ending);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&ending, number);
  ::sigprocmask(SIG_BLOCK, &ending, nullptr);
  ::signal(SIGPIPE, SIG_IGN);  // the reader of the replies may go
  fd_ = ::signalfd(-1, &ending, SFD_CLOEXEC);
  if (fd_ < 0) throw std::runtime_error(fmt::format("signalfd: {}", std::strerror(errno)));
}

EndingSignals::~EndingSignals() { ::close(fd_); }

Record open_record(const std::string& path, const char* heading) {
  if (path.empty()) return nullptr;
  Record record(std::fopen(path.c_str(), "we"));
  if (record == nullptr) throw std::runtime_error(path + ": " + std::strerror(errno));
  fmt::print(record.get(), "{}\n", heading);
  return record;
}

}  // namespace corbot::sim
