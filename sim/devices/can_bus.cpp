// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/can_bus.h"

#include <fmt/format.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace corbot::sim {
namespace {

constexpr std::string_view kUnix = "unix:";
constexpr int kMostWaiting = 8;
/// As many frames are taken from one of a bus before the others have their turn.
constexpr int kBurst = 64;

[[noreturn]] void fail(const std::string& name, const std::string& why) {
  throw std::runtime_error(name + ": " + why);
}

/// A bus at a Unix socket: every packet is a frame, and goes to every other node.
class VirtualBus final : public CanBus {
 public:
  explicit VirtualBus(std::string path) : path_(std::move(path)) {}
  ~VirtualBus() override { VirtualBus::close(); }

  void open() override {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path_.empty() || path_.size() >= sizeof(address.sun_path)) fail(path_, "no path of a socket");
    path_.copy(address.sun_path, path_.size());
    remove_dead_socket(address);
    fd_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd_ < 0) fail(path_, std::strerror(errno));
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      const int error = errno;
      ::close(std::exchange(fd_, -1));
      fail(path_, std::strerror(error));
    }
    struct stat made {};
    if (::stat(path_.c_str(), &made) == 0) inode_ = made.st_ino;
    if (::listen(fd_, kMostWaiting) != 0) fail(path_, std::strerror(errno));
  }

  void close() noexcept override {
    if (fd_ < 0) return;
    for (const int peer : peers_) ::close(peer);
    peers_.clear();
    ::close(std::exchange(fd_, -1));
    struct stat there {};  // perhaps another program's by now
    if (::stat(path_.c_str(), &there) == 0 && there.st_ino == inode_) (void)::unlink(path_.c_str());
  }

  [[nodiscard]] bool is_open() const override { return fd_ >= 0; }

  void add_to(std::vector<pollfd>& fds) const override {
    if (fd_ < 0) return;
    fds.push_back({fd_, POLLIN, 0});
    for (const int peer : peers_) fds.push_back({peer, POLLIN, 0});
  }

  std::vector<can_frame> read() override {
    std::vector<can_frame> frames;
    if (fd_ < 0) return frames;
    for (int peer = -1; (peer = ::accept4(fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) {
      peers_.push_back(peer);
    }
    for (int& peer : peers_) {
      if (read_from(peer, frames)) continue;
      ::close(std::exchange(peer, -1));
    }
    peers_.erase(std::remove(peers_.begin(), peers_.end(), -1), peers_.end());
    return frames;
  }

  void send(const can_frame& frame) override { send_to_others(frame, -1); }

 private:
  /// What a program that was killed has left; without a listener.
  void remove_dead_socket(const sockaddr_un& address) const {
    struct stat there {};
    if (::lstat(path_.c_str(), &there) != 0) return;
    if (!S_ISSOCK(there.st_mode)) fail(path_, "is no socket");
    const int probe = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    const bool is_dead =
        probe >= 0 && ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 &&
        errno == ECONNREFUSED;
    if (probe >= 0) ::close(probe);
    if (!is_dead) fail(path_, "another program has it open");
    (void)::unlink(path_.c_str());
  }

  /// False when the other end has gone.
  bool read_from(int peer, std::vector<can_frame>& frames) {
    for (int i = 0; i < kBurst; ++i) {
      can_frame frame{};
      const ssize_t n = ::recv(peer, &frame, sizeof(frame), MSG_TRUNC);
      if (n < 0) return errno == EAGAIN || errno == EINTR;
      if (n == 0) return false;
      if (n != static_cast<ssize_t>(sizeof(frame)) || frame.can_dlc > CAN_MAX_DLEN) continue;
      send_to_others(frame, peer);
      frames.push_back(frame);
    }
    return true;
  }

  void send_to_others(const can_frame& frame, int sender) {
    for (const int peer : peers_) {
      if (peer != sender && peer >= 0) (void)::send(peer, &frame, sizeof(frame), MSG_NOSIGNAL);
    }
  }

  std::string path_;
  int fd_{-1};
  ino_t inode_{0};
  std::vector<int> peers_;
};

/// An interface of the kernel.
class KernelBus final : public CanBus {
 public:
  explicit KernelBus(std::string interface) : interface_(std::move(interface)) {}
  ~KernelBus() override { KernelBus::close(); }

  void open() override {
    const unsigned index = ::if_nametoindex(interface_.c_str());
    if (index == 0) fail(interface_, "no such interface");
    fd_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd_ < 0) fail(interface_, fmt::format("no SocketCAN: {}", std::strerror(errno)));
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(index);
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return;
    const int error = errno;
    close();
    fail(interface_, std::strerror(error));
  }

  void close() noexcept override {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }

  [[nodiscard]] bool is_open() const override { return fd_ >= 0; }

  void add_to(std::vector<pollfd>& fds) const override {
    if (fd_ >= 0) fds.push_back({fd_, POLLIN, 0});
  }

  std::vector<can_frame> read() override {
    std::vector<can_frame> frames;
    can_frame frame{};
    while (fd_ >= 0 && frames.size() < kBurst &&
           ::recv(fd_, &frame, sizeof(frame), 0) == static_cast<ssize_t>(sizeof(frame))) {
      frames.push_back(frame);
    }
    return frames;
  }

  void send(const can_frame& frame) override {
    if (fd_ >= 0) (void)::send(fd_, &frame, sizeof(frame), MSG_NOSIGNAL);
  }

 private:
  std::string interface_;
  int fd_{-1};
};

}  // namespace

std::unique_ptr<CanBus> make_can_bus(const std::string& name) {
  if (name.starts_with(kUnix)) return std::make_unique<VirtualBus>(name.substr(kUnix.size()));
  return std::make_unique<KernelBus>(name);
}

}  // namespace corbot::sim
