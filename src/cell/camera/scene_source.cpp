// SPDX-License-Identifier: Apache-2.0
#include "cell/camera/scene_source.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "cell/picture_wire.h"
#include "cell/wall_clock.h"

namespace corbot::cell {
namespace {

using Clock = SceneSource::Clock;

/// One connection for one picture.
class Connection {
 public:
  Connection(const std::filesystem::path& path, Clock::time_point deadline)
      : name_(path.string()), deadline_(deadline), fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (fd_ < 0) fail(std::strerror(errno));
    try {
      connect();
    } catch (const SourceError&) {
      ::close(fd_);
      throw;
    }
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { ::close(fd_); }

  void trigger() {
    const char byte = 0;
    if (::send(fd_, &byte, 1, MSG_NOSIGNAL) != 1) fail(std::strerror(errno));
  }

  void read(void* to, std::size_t size) {
    auto* const bytes = static_cast<std::uint8_t*>(to);
    for (std::size_t done = 0; done < size;) {
      wait();
      const ssize_t count = ::recv(fd_, bytes + done, size - done, MSG_DONTWAIT);
      if (count == 0) fail(fmt::format("closed after {} of {} bytes", done, size));
      if (count < 0 && errno != EAGAIN && errno != EINTR) fail(std::strerror(errno));
      if (count > 0) done += static_cast<std::size_t>(count);
    }
  }

  [[noreturn]] void fail(const std::string& why) const { throw SourceError(name_ + ": " + why); }

 private:
  void connect() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (name_.size() >= sizeof(address.sun_path)) fail("the path of a socket has at most 107 bytes");
    name_.copy(address.sun_path, name_.size());
    // The time-out also limits connect(), which blocks while the peer's queue is full.
    const auto left = std::chrono::duration_cast<std::chrono::microseconds>(deadline_ - Clock::now()).count();
    if (left <= 0) fail_late();
    const timeval most{left / 1'000'000, left % 1'000'000};
    if (::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof(most)) != 0) fail(std::strerror(errno));
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return;
    if (errno == EAGAIN) fail_late();
    fail(std::strerror(errno));
  }

  /// Waits until the connection is readable.
  void wait() {
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
      if (left <= 0) fail_late();
      pollfd entry{fd_, POLLIN, 0};
      const int count = ::poll(&entry, 1, static_cast<int>(std::min<std::int64_t>(left, 60'000)));
      if (count > 0) return;
      if (count < 0 && errno != EINTR) fail(std::strerror(errno));
    }
  }

  [[noreturn]] void fail_late() const { fail("no picture in time"); }

  std::string name_;
  Clock::time_point deadline_;
  int fd_;
};

/// Returns why the header is invalid for a picture triggered at `asked_s`; empty if it is valid.
std::string fault_of(const PictureHeader& header, std::array<int, 2> size_px, double asked_s) {
  if (header.magic != PictureHeader::kMagic)
    return fmt::format("no picture: it begins with {:#010x}, not {:#010x}", header.magic,
                       PictureHeader::kMagic);
  if (!std::cmp_equal(header.columns, size_px[0]) || !std::cmp_equal(header.rows, size_px[1]))
    return fmt::format("a picture of {} x {} pixels; the calibration is for {} x {}", header.columns,
                       header.rows, size_px[0], size_px[1]);
  if (!std::isfinite(header.exposure_s) || header.exposure_s < asked_s)
    return fmt::format("a picture of time {:.6f}, before it was asked for at {:.6f}", header.exposure_s,
                       asked_s);
  return "";
}

}  // namespace

SceneSource::SceneSource(std::filesystem::path socket, std::array<int, 2> size_px)
    : socket_(std::move(socket)),
      size_px_(size_px),
      bytes_(3 * static_cast<std::size_t>(size_px[0]) * static_cast<std::size_t>(size_px[1])) {}

SourcePicture SceneSource::take(Clock::time_point deadline) {
  Connection connection(socket_, deadline);
  const double asked_s = now_s();
  connection.trigger();
  PictureHeader header;
  connection.read(&header, sizeof(header));
  if (const std::string fault = fault_of(header, size_px_, asked_s); !fault.empty()) connection.fail(fault);
  connection.read(bytes_.data(), bytes_.size());
  return {header.exposure_s, bytes_};
}

}  // namespace corbot::cell
