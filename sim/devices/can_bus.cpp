// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/can_bus.h"

#include <fmt/format.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "sim/devices/unix_listener.h"

namespace corbot::sim {
namespace {

constexpr std::string_view kUnix = "unix:";
/// The number of frames taken from one client before the others have their turn.
constexpr int kBurst = 64;

[[noreturn]] void no_bus(const std::string& name, const std::string& why) {
  throw std::runtime_error(name + ": " + why);
}

/// A bus at a Unix socket: every packet is a frame, and goes to every other node.
class VirtualBus final : public CanBus {
 public:
  explicit VirtualBus(std::string path) : path_(std::move(path)) {}
  ~VirtualBus() override { VirtualBus::close(); }

  void open() override { listener_.emplace(path_, SOCK_SEQPACKET); }

  void close() noexcept override {
    for (const int peer : peers_) ::close(peer);
    peers_.clear();
    listener_.reset();
  }

  [[nodiscard]] bool is_open() const override { return listener_.has_value(); }

  void add_to(std::vector<pollfd>& fds) const override {
    if (!listener_) return;
    fds.push_back({listener_->fd(), POLLIN, 0});
    for (const int peer : peers_) fds.push_back({peer, POLLIN, 0});
  }

  std::vector<can_frame> read() override {
    std::vector<can_frame> frames;
    if (!listener_) return frames;
    for (int peer = -1; (peer = listener_->accept()) >= 0;) peers_.push_back(peer);
    for (int& peer : peers_) {
      if (read_from(peer, frames)) continue;
      ::close(std::exchange(peer, -1));
    }
    peers_.erase(std::remove(peers_.begin(), peers_.end(), -1), peers_.end());
    return frames;
  }

  void send(const can_frame& frame) override { send_to_others(frame, -1); }

 private:
  /// Reads the frames of a client; false if the client has gone.
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
  std::optional<UnixListener> listener_;
  std::vector<int> peers_;
};

/// An interface of the kernel.
class KernelBus final : public CanBus {
 public:
  explicit KernelBus(std::string interface) : interface_(std::move(interface)) {}
  ~KernelBus() override { KernelBus::close(); }

  void open() override {
    const unsigned index = ::if_nametoindex(interface_.c_str());
    if (index == 0) no_bus(interface_, "no such interface");
    fd_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd_ < 0) no_bus(interface_, fmt::format("no SocketCAN: {}", std::strerror(errno)));
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(index);
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return;
    const int error = errno;
    close();
    no_bus(interface_, std::strerror(error));
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
