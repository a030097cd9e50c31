// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/pty_port.h"

#include <fcntl.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

namespace corbot::sim {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::pair<int, speed_t>, 10> kSpeeds{{{300, B300},
                                                           {1200, B1200},
                                                           {2400, B2400},
                                                           {4800, B4800},
                                                           {9600, B9600},
                                                           {19200, B19200},
                                                           {38400, B38400},
                                                           {57600, B57600},
                                                           {115200, B115200},
                                                           {230400, B230400}}};

std::optional<speed_t> speed_of(int baud) {
  for (const auto& [known, speed] : kSpeeds) {
    if (known == baud) return speed;
  }
  return std::nullopt;
}

}  // namespace

void PtyPort::fail(const std::string& what) {
  const std::string why = std::strerror(errno);
  close();
  throw std::runtime_error(what + ": " + why);
}

void PtyPort::open() {
  close();
  device_fd_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (device_fd_ < 0 || ::grantpt(device_fd_) != 0 || ::unlockpt(device_fd_) != 0) {
    fail("no pseudo-terminal");
  }
  std::array<char, 128> name{};
  if (::ptsname_r(device_fd_, name.data(), name.size()) != 0) fail("no name of the pseudo-terminal");
  name_ = name.data();
  host_fd_ = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios line{};
  if (host_fd_ < 0 || ::tcgetattr(host_fd_, &line) != 0) fail(name_);
  ::cfmakeraw(&line);  // no echo of the answers while no program has set the line
  if (const auto speed = speed_of(baud_)) (void)::cfsetspeed(&line, *speed);
  if (::tcsetattr(host_fd_, TCSANOW, &line) != 0) fail(name_);
  watch_fd_ = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (watch_fd_ >= 0) (void)::inotify_add_watch(watch_fd_, name_.c_str(), IN_CLOSE);
  make_link();
}

void PtyPort::make_link() {
  std::error_code error;
  const auto status = fs::symlink_status(link_, error);
  if (fs::exists(status) && !fs::is_symlink(status)) {
    errno = EEXIST;
    fail(link_ + " is no symbolic link and is left alone");
  }
  // The link is made aside and renamed: a program that waits for the link never finds it missing half-way.
  const std::string aside = link_ + "." + std::to_string(::getpid());
  if (::symlink(name_.c_str(), aside.c_str()) != 0) fail(link_);
  if (::rename(aside.c_str(), link_.c_str()) != 0) {
    const int why = errno;
    (void)::unlink(aside.c_str());
    errno = why;
    fail(link_);
  }
}

void PtyPort::close() noexcept {
  for (int* fd : {&host_fd_, &watch_fd_}) {
    if (*fd >= 0) ::close(std::exchange(*fd, -1));
  }
  if (device_fd_ < 0) return;
  std::error_code error;
  if (!name_.empty() && fs::read_symlink(link_, error) == name_) (void)::unlink(link_.c_str());
  ::close(std::exchange(device_fd_, -1));
}

std::size_t PtyPort::read(std::span<std::uint8_t> into) const {
  const ssize_t n = ::read(device_fd_, into.data(), into.size());
  return n > 0 ? static_cast<std::size_t>(n) : 0;
}

void PtyPort::write(std::span<const std::uint8_t> bytes) const {
  if (bytes.empty() || !is_open()) return;
  (void)!::write(device_fd_, bytes.data(), bytes.size());
}

bool PtyPort::is_wrong_baud() const {
  const auto speed = speed_of(baud_);
  termios line{};
  return speed && ::tcgetattr(host_fd_, &line) == 0 && ::cfgetospeed(&line) != *speed;
}

void PtyPort::after_closed() const {
  std::array<char, 4096> events{};
  while (::read(watch_fd_, events.data(), events.size()) > 0) {
  }
  (void)::ioctl(host_fd_, TIOCNXCL);
}

}  // namespace corbot::sim
