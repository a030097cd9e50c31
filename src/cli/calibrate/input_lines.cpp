// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/input_lines.h"

#include <poll.h>
#include <unistd.h>

#include <utility>

namespace corbot::cli {
namespace {

constexpr std::size_t kLongest = 1u << 16;

}  // namespace

std::optional<std::string> InputLines::next() {
  for (;;) {
    if (end_) return std::nullopt;  // even if a line was typed before
    if (const auto at = text_.find('\n'); at != std::string::npos) {
      std::string line = text_.substr(0, at);
      text_.erase(0, at + 1);
      return line;
    }
    if (ended_) return text_.empty() ? std::nullopt : std::optional(std::exchange(text_, {}));
    pollfd input{STDIN_FILENO, POLLIN, 0};
    constexpr int kPoll_ms = 100;
    if (::poll(&input, 1, kPoll_ms) <= 0) continue;
    char bytes[1024];
    const ssize_t n = ::read(STDIN_FILENO, bytes, sizeof(bytes));
    if (n > 0) text_.append(bytes, static_cast<std::size_t>(n));
    if (n <= 0 || text_.size() > kLongest) ended_ = true;
  }
}

}  // namespace corbot::cli
