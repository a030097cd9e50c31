// SPDX-License-Identifier: Apache-2.0
#include "log/line_output.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace corbot {

namespace {

constexpr const char* kEraseLine = "\r\x1b[K";

}  // namespace

LineOutput::LineOutput(int fd) : fd_(fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) return;
  if (S_ISSOCK(status.st_mode)) kind_ = Kind::kSocket;
  if (!S_ISFIFO(status.st_mode) && !S_ISCHR(status.st_mode)) return;
  const std::string path = "/proc/self/fd/" + std::to_string(fd);
  own_ = Descriptor(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!own_) return;
  fd_ = own_.get();
  kind_ = Kind::kWaitsNever;
}

std::size_t LineOutput::put(std::string_view text) const noexcept {
  ssize_t written = -1;
  switch (kind_) {
    case Kind::kWaitsNever:
      written = ::write(fd_, text.data(), text.size());
      break;
    case Kind::kSocket:
      written = ::send(fd_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      break;
    case Kind::kOther: {
      // A file, or another user's terminal, which may be stopped in the moment between.
      pollfd room{fd_, POLLOUT, 0};
      if (::poll(&room, 1, 0) == 1 && (room.revents & POLLOUT) != 0)
        written = ::write(fd_, text.data(), text.size());
      break;
    }
  }
  return written > 0 ? static_cast<std::size_t>(written) : 0;
}

void LineOutput::write(std::string_view line) noexcept {
  try {
    draw("");
    std::string text = is_torn_ ? "\n" : "";
    if (left_out_ > 0)
      text += "(" + std::to_string(left_out_) + " lines were left out, because no program read the output)\n";
    const std::size_t before = text.size();
    text += line;
    text += '\n';
    const std::size_t done = put(text);
    if (done > 0) is_torn_ = text[done - 1] != '\n';
    if (done >= before && done > 0) left_out_ = 0;
    if (done < text.size()) ++left_out_;
  } catch (...) {  // no memory for the line
    ++left_out_;
  }
}

bool LineOutput::can_redraw() const noexcept {
  const char* const kind = std::getenv("TERM");
  return ::isatty(fd_) == 1 && kind != nullptr && std::string_view(kind) != "dumb";
}

void LineOutput::draw(std::string_view line) noexcept {
  if ((line.empty() && !is_drawn_) || !can_redraw()) return;
  try {
    (void)put(std::string(kEraseLine).append(line));
    is_drawn_ = !line.empty();
  } catch (...) {  // NOLINT(bugprone-empty-catch): no memory for the line; the next one may have it
  }
}

}  // namespace corbot
