// SPDX-License-Identifier: Apache-2.0
#include "net/ports.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "net/endpoint.h"

namespace corbot::net {

std::optional<std::pair<std::string, int>> split_endpoint(const std::string& text, std::string* why) {
  corbot_endpoint endpoint{};
  char reason[CORBOT_WHY] = "";
  const bool good = corbot_endpoint_parse(text.c_str(), &endpoint, reason);
  if (why != nullptr) *why = reason;
  if (!good) return std::nullopt;
  return std::pair{std::string(endpoint.host), endpoint.port};
}

std::string endpoint_text(const std::string& host, int port) {
  char text[CORBOT_HOST + 16];
  corbot_endpoint_text(host.c_str(), port, text, sizeof(text));
  return text;
}

std::string listen_error(const std::string& host, int port) {
  int bound = 0;
  char why[CORBOT_WHY];
  const int fd = corbot_listen(host.c_str(), port, &bound, why);
  if (fd < 0) return why;
  ::close(fd);
  return {};
}

bool listens_on_loopback(int port) noexcept {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool accepted = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  ::close(fd);
  return accepted;
}

}  // namespace corbot::net
