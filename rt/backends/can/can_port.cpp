// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/can_port.h"

#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "corbot/running_time.h"

namespace corbot::rt {
namespace {

constexpr std::string_view kUnixPort = "unix:";
/// The memory that the kernel counts for a frame that waits to be sent.
constexpr std::size_t kFrameMemory = 768;
/// The kernel does not signal when a transmit queue has room again: poll() always reports it writable.
constexpr timespec kRetryFull{0, 100'000};
constexpr std::chrono::milliseconds kLongestLook{20};

}  // namespace

void CanPort::fail(DeviceCause cause, const std::string& what) const {
  throw DeviceError(cause, interface_ + ": " + what);
}

void CanPort::fail(int error) const {
  switch (error) {
    case ENETDOWN:
      fail(DeviceCause::kBusDown, "the interface went down");
    case ENODEV:
    case ENXIO:
      fail(DeviceCause::kBusDown, "the interface was removed: check the plug of the adapter");
    case EPIPE:
    case ECONNRESET:
      fail(DeviceCause::kBusDown, "the bus was cut");
    default:
      fail(DeviceCause::kBusDown, std::strerror(error));
  }
}

void CanPort::open(const std::string& interface, const std::vector<canid_t>& identifiers) {
  close();
  interface_ = interface;
  wanted_ = identifiers;
  is_virtual_ = interface.starts_with(kUnixPort);
  try {
    if (is_virtual_) {
      open_unix(interface.substr(kUnixPort.size()));
    } else {
      open_socket(identifiers);
    }
  } catch (const DeviceError&) {
    close();
    throw;
  }
}

void CanPort::open_unix(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) fail(DeviceCause::kNotThere, "the path is too long");
  path.copy(address.sun_path, path.size());
  fd_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) fail(DeviceCause::kNotThere, std::strerror(errno));
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int error = errno;
    struct stat status {};
    const bool is_file = ::stat(path.c_str(), &status) == 0 && !S_ISSOCK(status.st_mode);
    fail(DeviceCause::kNotThere,
         is_file ? "is a file, not the socket of a virtual CAN bus" : std::strerror(error));
  }
}

void CanPort::open_socket(const std::vector<canid_t>& identifiers) {
  fd_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0) {
    fail(DeviceCause::kNotThere, errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT
                                     ? "this kernel has no SocketCAN (modprobe can-raw)"
                                     : std::strerror(errno));
  }
  ifreq request{};
  if (interface_.size() >= sizeof(request.ifr_name)) fail(DeviceCause::kNotThere, "no such interface");
  interface_.copy(request.ifr_name, interface_.size());
  if (::ioctl(fd_, SIOCGIFINDEX, &request) != 0) fail(DeviceCause::kNotThere, "no such interface");
  const int index = request.ifr_ifindex;
  if (::ioctl(fd_, SIOCGIFFLAGS, &request) != 0) fail(errno);
  // A socket bound to an interface that is down would only fail later.
  if ((request.ifr_flags & IFF_UP) == 0) {
    fail(DeviceCause::kBusDown, "the interface is down (ip link set " + interface_ + " up)");
  }
  std::vector<can_filter> filters;
  for (const canid_t id : identifiers) filters.push_back({id, CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK});
  const can_err_mask_t errors =
      CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL | CAN_ERR_ACK | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
  const int off = 0;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  const auto bytes = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  if (::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), bytes) != 0 ||
      ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) != 0 ||
      ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &off, sizeof(off)) != 0) {
    fail(DeviceCause::kNotThere, std::strerror(errno));
  }
  if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fail(DeviceCause::kNotThere, errno == ENODEV
                                     ? "is not a CAN interface: 'ip link show type can' lists them"
                                     : std::strerror(errno));
  }
}

void CanPort::limit_queue(std::size_t frames) {
  // The kernel doubles it, and counts the memory of a frame, not its bytes; its least is some six frames.
  const int bytes = static_cast<int>(frames * kFrameMemory / 2);
  if (::setsockopt(fd_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes)) != 0) {
    fail(DeviceCause::kNotThere, std::strerror(errno));
  }
}

void CanPort::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

void CanPort::write(const CanFrame& frame, Clock::time_point deadline) {
  constexpr std::chrono::milliseconds kLongest{2};  // the longest counted time between two looks
  const auto begin = Clock::now();
  const auto bound = std::max<Clock::duration>(deadline - begin, kLongestLook);
  RunningTime waited(kLongest, begin);
  for (;;) {
    const ssize_t n = ::send(fd_, &frame, sizeof(frame), MSG_NOSIGNAL);
    if (n == static_cast<ssize_t>(sizeof(frame))) return;
    const int error = n < 0 ? errno : EIO;
    if (error != ENOBUFS && error != EAGAIN && error != EINTR) fail(error);
    if (waited.look(Clock::now()) >= bound) {
      fail(DeviceCause::kWriteTimeout,
           "write timed out: is a drive connected and powered, is the bus terminated?");
    }
    ::nanosleep(&kRetryFull, nullptr);
  }
}

bool CanPort::is_wanted(const CanFrame& frame) const {
  if (frame.can_dlc > CAN_MAX_DLEN) return false;
  if (!is_virtual_) return true;
  return std::find(wanted_.begin(), wanted_.end(), frame.can_id) != wanted_.end();
}

/// Does not count the time during which this thread, or the machine, stood still.
std::optional<CanFrame> CanPort::read(Clock::time_point deadline) {
  const auto begin = Clock::now();
  const Clock::duration bound = deadline - begin;
  RunningTime waited(2 * kLongestLook, begin);
  for (;;) {
    const Clock::duration left = std::min<Clock::duration>(bound - waited.look(Clock::now()), kLongestLook);
    CanFrame frame{};
    const ssize_t n = ::recv(fd_, &frame, sizeof(frame), 0);
    if (n == static_cast<ssize_t>(sizeof(frame)) && is_wanted(frame)) return frame;
    if (n == 0) fail(EPIPE);
    if (n > 0) continue;  // not a frame, or of no node here
    if (errno == EINTR) continue;
    if (errno != EAGAIN) fail(errno);
    if (left <= Clock::duration::zero()) return std::nullopt;
    pollfd ready{fd_, POLLIN, 0};
    (void)::poll(&ready, 1, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count()));
  }
}

}  // namespace corbot::rt
