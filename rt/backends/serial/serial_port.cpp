// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/serial_port.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "corbot/running_time.h"
#include "rt/backends/serial/adapter_latency.h"

namespace corbot::rt {
namespace {

constexpr std::array<std::pair<int, speed_t>, 9> kSpeeds{{{1200, B1200},
                                                          {2400, B2400},
                                                          {4800, B4800},
                                                          {9600, B9600},
                                                          {19200, B19200},
                                                          {38400, B38400},
                                                          {57600, B57600},
                                                          {115200, B115200},
                                                          {230400, B230400}}};

constexpr std::string_view kUnix = "unix:";
constexpr const char* kCut = "the line was cut: is the plug out?";

speed_t speed_of(int baud) noexcept {
  const auto* const found =
      std::find_if(kSpeeds.begin(), kSpeeds.end(), [&](const auto& entry) { return entry.first == baud; });
  return found == kSpeeds.end() ? B0 : found->second;
}

}  // namespace

bool SerialPort::is_baud(int baud) noexcept { return speed_of(baud) != B0; }
bool SerialPort::is_socket(std::string_view path) noexcept { return path.starts_with(kUnix); }

void SerialPort::fail(DeviceCause cause, const std::string& what) const {
  throw DeviceError(cause, path_ + ": " + what);
}

void SerialPort::open(const std::string& path, int baud) {
  close();
  path_ = path;
  is_socket_ = is_socket(path);
  if (is_socket_) return open_socket(std::string_view(path).substr(kUnix.size()));
  // Opens without blocking, or open() would wait for a modem's carrier.
  fd_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    const DeviceCause cause = errno == EBUSY ? DeviceCause::kInUse : DeviceCause::kNotThere;
    const std::string hint = errno == EACCES ? " (join the group dialout, or install the udev rule)" : "";
    fail(cause, std::strerror(errno) + hint);
  }
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    close();
    fail(DeviceCause::kInUse, "another program has it open");
  }
  // Excludes programs that do not lock; a pseudo-terminal may not support it.
  is_exclusive_ = ::ioctl(fd_, TIOCEXCL) == 0;
  termios line{};
  if (::tcgetattr(fd_, &line) != 0) {
    close();
    fail(DeviceCause::kNotThere, "is not a serial line: check the port in the profile");
  }
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB | HUPCL);
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  ::cfsetispeed(&line, speed_of(baud));
  ::cfsetospeed(&line, speed_of(baud));
  if (::tcsetattr(fd_, TCSANOW, &line) != 0) {
    const std::string why = std::strerror(errno);
    close();
    fail(DeviceCause::kNotThere, std::to_string(baud) + " baud: " + why);
  }
  ask_for_low_latency();
  (void)::tcflush(fd_, TCIOFLUSH);
}

void SerialPort::open_socket(std::string_view path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  constexpr std::size_t kLongest = sizeof(address.sun_path) - 1;
  if (path.size() > kLongest) {
    fail(DeviceCause::kNotThere,
         "the path has " + std::to_string(path.size()) + " bytes, at most " + std::to_string(kLongest));
  }
  path.copy(address.sun_path, path.size());
  fd_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) fail(DeviceCause::kNotThere, std::strerror(errno));
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return;
  const int error = errno;
  close();
  // The kernel's queue of the listener is full.
  fail(error == EAGAIN ? DeviceCause::kInUse : DeviceCause::kNotThere, std::strerror(error));
}

/// Requests low latency: an FTDI adapter otherwise keeps received data for 16 ms. It has no effect if the
/// driver does not support it.
void SerialPort::ask_for_low_latency() noexcept {
  serial_struct line{};
  if (::ioctl(fd_, TIOCGSERIAL, &line) != 0 || (line.flags & ASYNC_LOW_LATENCY) != 0) return;
  line.flags |= ASYNC_LOW_LATENCY;
  (void)::ioctl(fd_, TIOCSSERIAL, &line);
}

std::optional<int> SerialPort::latency_ms() const {
  return is_socket_ ? std::nullopt : latency_timer_ms(path_);
}

void SerialPort::close() noexcept {
  if (fd_ < 0) return;
  // Otherwise the kernel waits half a minute for a line that takes no bytes.
  if (std::exchange(is_stuck_, false)) (void)::tcflush(fd_, TCOFLUSH);
  // The lock of another program, which has refused this one, stays.
  if (std::exchange(is_exclusive_, false)) (void)::ioctl(fd_, TIOCNXCL);
  ::close(std::exchange(fd_, -1));
}

/// Waits for the line. A deadline can pass while this thread, or the machine, stands still. Then it polls for
/// a while before it gives up.
void SerialPort::await(short events, Clock::time_point deadline, DeviceCause late) {
  constexpr std::chrono::milliseconds kLookEvery{20};
  const auto begin = Clock::now();
  const auto bound = std::max<Clock::duration>(deadline - begin, kLookEvery);
  RunningTime waited(2 * kLookEvery, begin);
  for (;;) {
    const Clock::duration left = std::min<Clock::duration>(bound - waited.look(Clock::now()), kLookEvery);
    pollfd ready{fd_, events, 0};
    const auto left_ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    const int count = ::poll(&ready, 1, static_cast<int>(std::max<decltype(left_ms)>(left_ms, 0)));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(DeviceCause::kHungUp, std::strerror(errno));
    // A line that was cut is readable, too, and for ever.
    if (count > 0 && (ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) {
      fail(DeviceCause::kHungUp, kCut);
    }
    if (count > 0) return;
    if (left <= Clock::duration::zero()) {
      is_stuck_ |= late == DeviceCause::kWriteTimeout;
      fail(late, late == DeviceCause::kNoAnswer ? "no answer: is the controller powered, is the baud right?"
                                                : "write timed out");
    }
  }
}

void SerialPort::write(std::span<const std::uint8_t> bytes, Clock::time_point deadline) {
  while (!bytes.empty()) {
    const ssize_t n = is_socket_ ? ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                                 : ::write(fd_, bytes.data(), bytes.size());
    if (n > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    } else if (n < 0 && errno != EAGAIN && errno != EINTR) {
      is_stuck_ = true;
      fail(DeviceCause::kHungUp, std::strerror(errno));
    } else {
      await(POLLOUT, deadline, DeviceCause::kWriteTimeout);
    }
  }
}

void SerialPort::check() {
  pollfd line{fd_, 0, 0};
  if (::poll(&line, 1, 0) > 0) fail(DeviceCause::kHungUp, kCut);
}

std::size_t SerialPort::read(std::span<std::uint8_t> into, Clock::time_point deadline) {
  for (;;) {
    const ssize_t n = ::read(fd_, into.data(), into.size());
    if (n > 0) return static_cast<std::size_t>(n);
    if (n < 0 && errno != EAGAIN && errno != EINTR) fail(DeviceCause::kHungUp, std::strerror(errno));
    if (n == 0 && is_socket_) fail(DeviceCause::kHungUp, kCut);
    // No data: with VMIN = 0 this reads as 0, as does a line that was cut; poll distinguishes the two.
    await(POLLIN, deadline, DeviceCause::kNoAnswer);
  }
}

void SerialPort::read_exactly(std::span<std::uint8_t> into, Clock::time_point deadline) {
  while (!into.empty()) into = into.subspan(read(into, deadline));
}

void SerialPort::discard_input() {
  if (!is_socket_) return (void)::tcflush(fd_, TCIFLUSH);
  // Bounded: a peer may send without end. Later calls find a cut.
  constexpr int kMostReads = 64;
  std::array<std::uint8_t, 4096> dropped{};
  for (int i = 0; i < kMostReads; ++i) {
    if (::recv(fd_, dropped.data(), dropped.size(), 0) <= 0) return;
  }
}

}  // namespace corbot::rt
