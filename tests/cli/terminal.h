// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <string>

namespace corbot::test {

/// The operator's side of a terminal.
class Terminal {
 public:
  Terminal() : fd_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    termios line{};
    EXPECT_EQ(::grantpt(fd_) | ::unlockpt(fd_) | ::tcgetattr(fd_, &line), 0);
    ::cfmakeraw(&line);  // no echo
    EXPECT_EQ(::tcsetattr(fd_, TCSANOW, &line), 0);
    path_ = ::ptsname(fd_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() { ::close(fd_); }
  [[nodiscard]] const std::string& path() const { return path_; }
  void type(const std::string& line) const {
    const std::string text = line + "\n";
    EXPECT_EQ(::write(fd_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }

 private:
  int fd_;
  std::string path_;
};

}  // namespace corbot::test
