// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "net/connections.h"

namespace corbot::test {

/// Listens on the loopback interface; what it accepts is counted, as in a servant.
class Listener {
 public:
  Listener() : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    corbot_connections_start();
    corbot_connections_serve();
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address_);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address_), size), 0);
    EXPECT_EQ(::listen(fd_, SOMAXCONN), 0);
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address_), &size), 0);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() { ::close(fd_); }
  [[nodiscard]] const sockaddr_in& address() const { return address_; }
  [[nodiscard]] int accept() const { return ::accept(fd_, nullptr, nullptr); }

 private:
  int fd_;
  sockaddr_in address_{};
};

/// Both ends of one connection; `server` is -1 where it was refused.
struct AcceptedPair {
  /// `own`: announced as one of this process's.
  explicit AcceptedPair(const Listener& listener, bool own = false)
      : client(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (own) {
      sockaddr_in from{};
      from.sin_family = AF_INET;
      socklen_t size = sizeof(from);
      EXPECT_EQ(::bind(client, reinterpret_cast<sockaddr*>(&from), size), 0);
      EXPECT_EQ(::getsockname(client, reinterpret_cast<sockaddr*>(&from), &size), 0);
      corbot_connections_expect_own(ntohs(from.sin_port));
    }
    EXPECT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&listener.address()), sizeof(sockaddr_in)),
              0);
    server = listener.accept();
  }
  /// From another host, by one of this machine's own addresses.
  struct From {
    const char* host;
  };
  AcceptedPair(const Listener& listener, From of) : client(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in from{};
    from.sin_family = AF_INET;
    EXPECT_EQ(::inet_pton(AF_INET, of.host, &from.sin_addr), 1);
    EXPECT_EQ(::bind(client, reinterpret_cast<sockaddr*>(&from), sizeof(from)), 0);
    EXPECT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&listener.address()), sizeof(sockaddr_in)),
              0);
    server = listener.accept();
  }
  AcceptedPair(AcceptedPair&& other) noexcept
      : client(std::exchange(other.client, -1)), server(std::exchange(other.server, -1)) {}
  AcceptedPair(const AcceptedPair&) = delete;
  AcceptedPair& operator=(const AcceptedPair&) = delete;
  AcceptedPair& operator=(AcceptedPair&&) = delete;
  ~AcceptedPair() {
    if (client >= 0) ::close(client);
    if (server >= 0) ::close(server);
  }
  int client;
  int server{-1};
};

}  // namespace corbot::test
