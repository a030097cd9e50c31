// SPDX-License-Identifier: Apache-2.0
#include "soak/proxy.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <stdexcept>

namespace corbot::soak {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

constexpr int kPoll_ms = 20;

}  // namespace

Proxy::Proxy(int port, int target_port)
    : target_port_(target_port), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int on = 1;
  ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const sockaddr_in address = loopback(port);
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(listener_, 64) != 0) {
    ::close(listener_);
    throw std::runtime_error("the proxy cannot listen");
  }
  thread_ = std::thread([this] { run(); });
}

Proxy::~Proxy() {
  end_ = true;
  thread_.join();
  cut();
  ::close(listener_);
}

void Proxy::reset(const Pair& pair) {
  const linger at_once{1, 0};
  for (const int fd : {pair.client, pair.server}) {
    ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
    ::close(fd);
  }
}

void Proxy::cut() {
  const std::lock_guard lock(mutex_);
  for (const Pair& pair : pairs_) reset(pair);
  pairs_.clear();
}

void Proxy::accept_one() {
  const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(target_port_);
  if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    ::close(server);
    ::close(client);
    return;
  }
  pairs_.push_back({client, server});
}

bool Proxy::pass(int from, int to) {
  char bytes[16384];
  const ssize_t n = ::recv(from, bytes, sizeof(bytes), MSG_DONTWAIT);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) return false;
  for (ssize_t done = 0; done < n;) {
    const ssize_t sent = ::send(to, bytes + done, static_cast<std::size_t>(n - done), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    done += sent;
  }
  return true;
}

void Proxy::run() {
  while (!end_) {
    std::vector<pollfd> fds{{listener_, POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const Pair& pair : pairs_) {
        fds.push_back({pair.client, POLLIN, 0});
        fds.push_back({pair.server, POLLIN, 0});
      }
    }
    if (swallow_) {
      (void)::poll(fds.data(), 1, kPoll_ms);
      const std::lock_guard lock(mutex_);
      if ((fds[0].revents & POLLIN) != 0) accept_one();
      continue;
    }
    if (::poll(fds.data(), fds.size(), kPoll_ms) <= 0) continue;
    const std::lock_guard lock(mutex_);
    if ((fds[0].revents & POLLIN) != 0) accept_one();
    for (std::size_t i = 0; i < pairs_.size();) {
      const Pair pair = pairs_[i];
      if (pass(pair.client, pair.server) && pass(pair.server, pair.client)) {
        ++i;
        continue;
      }
      reset(pair);
      pairs_.erase(pairs_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

}  // namespace corbot::soak
