// SPDX-License-Identifier: Apache-2.0
#include "support/ports.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace corbot::test {

namespace {

constexpr int kFirstTestPort = 10000;

/// Returns the first of the ports that the kernel hands out by itself, to every connection that a program
/// opens.
int first_ephemeral_port() {
  std::ifstream file("/proc/sys/net/ipv4/ip_local_port_range");
  int first = 0;
  return file >> first && first > kFirstTestPort + 1000 ? first : 32768;
}

/// Claims the port among all test programs of this machine: the abstract socket that stands for it lives as
/// long as this program, and leaves nothing behind. False when another program has claimed or bound the port.
/// `claim` receives the socket.
bool claim_port(int port, int& claim) {
  claim = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  const std::string text = "corbot-test-port-" + std::to_string(port);
  text.copy(name.sun_path + 1, sizeof(name.sun_path) - 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
  if (::bind(claim, reinterpret_cast<sockaddr*>(&name), size) != 0) {
    ::close(claim);
    return false;
  }
  const int probe = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool is_free = ::bind(probe, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  ::close(probe);
  if (!is_free) ::close(claim);
  return is_free;
}

}  // namespace

int free_port() { return free_ports(1); }

int free_ports(int count) {
  static std::atomic<int> next{::getpid()};
  const int end = first_ephemeral_port();
  const int range = end - kFirstTestPort - count + 1;
  for (int tries = 0; tries < range; ++tries) {
    const int first =
        kFirstTestPort + static_cast<int>(static_cast<unsigned>(next++) % static_cast<unsigned>(range));
    std::vector<int> claims;
    int claim = -1;
    while (static_cast<int>(claims.size()) < count &&
           claim_port(first + static_cast<int>(claims.size()), claim))
      claims.push_back(claim);
    if (static_cast<int>(claims.size()) == count) {
      next += count - 1;
      return first;
    }
    for (const int taken : claims) ::close(taken);
  }
  throw std::runtime_error("no free ports below " + std::to_string(end));
}

}  // namespace corbot::test
