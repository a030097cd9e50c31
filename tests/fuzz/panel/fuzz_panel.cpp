// SPDX-License-Identifier: Apache-2.0
// Browsers that send a panel any bytes. Without CORBOT_WEBSOCKET they send the bytes as they are, as requests
// of HTTP. With CORBOT_WEBSOCKET they first open a WebSocket. After an odd first byte they send the rest as
// it is, otherwise as one text. The fuzzer aborts if the panel does not close a connection of which it has
// read the end.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <thread>

#include "panel/server.h"
#include "unit/panel/fake_port.h"

namespace {

using namespace corbot::panel;

#ifdef CORBOT_WEBSOCKET
constexpr bool kOpensWebSocket = true;
#else
constexpr bool kOpensWebSocket = false;
#endif

constexpr const char* kHandshake =
    "GET /ws?token=t HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

/// One panel with two robots. It serves until the process ends.
int port_of_panel() {
  const std::filesystem::path pages = std::filesystem::temp_directory_path() / "corbot-fuzz-panel";
  std::filesystem::create_directories(pages);
  ServerSettings settings;
  settings.pages = pages;
  settings.watch_token = "t";
  settings.drive_token = "d";
  std::vector<std::unique_ptr<Watch>> robots;
  for (const char* name : {"one", "two"}) {
    auto port = std::make_unique<FakePort>(std::make_shared<FakeRobot>());
    robots.push_back(std::make_unique<Watch>(name, std::move(port)));
  }
  static Server* const server = new Server(std::move(settings), std::move(robots));
  std::thread([] { server->run(); }).detach();
  return server->port();
}

int connect_to(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  int socket = -1;
  for (;;) {  // the fuzzer's own timer can interrupt
    socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) break;
    if (errno != EINTR) std::abort();
    ::close(socket);
  }
  const timeval patience{.tv_sec = 4, .tv_usec = 0};
  (void)::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  // A reset at the end leaves no port in TIME_WAIT, of which the kernel has some 28,000.
  const linger reset{.l_onoff = 1, .l_linger = 0};
  (void)::setsockopt(socket, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
  return socket;
}

void send_all(int socket, std::span<const std::uint8_t> bytes) {
  (void)::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);  // the panel may have closed
}

void send_all(int socket, const std::string& text) {
  send_all(socket, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// Returns the frame of a text of at most 65,535 bytes. The mask is zero.
std::string frame_of(std::span<const std::uint8_t> text) {
  const auto size = static_cast<std::uint16_t>(text.size());
  std::string frame{'\x81', '\xfe', static_cast<char>(size >> 8), static_cast<char>(size & 0xff), 0, 0, 0, 0};
  return frame.append(text.begin(), text.end());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int port = port_of_panel();
  if (size < 2 || size > 16'384) return 0;
  const int socket = connect_to(port);
  const std::span<const std::uint8_t> bytes(data, size);
  if (!kOpensWebSocket) {
    send_all(socket, bytes);
  } else {
    send_all(socket, kHandshake);
    if (bytes[0] % 2 == 1) {
      send_all(socket, bytes.subspan(1));
    } else {
      send_all(socket, frame_of(bytes.subspan(1)));
    }
  }
  (void)::shutdown(socket, SHUT_WR);
  std::array<char, 4096> reply{};
  ssize_t count = 0;
  do count = ::recv(socket, reply.data(), reply.size(), 0);
  while (count > 0);
  if (count < 0 && errno == EAGAIN) std::abort();
  ::close(socket);
  return 0;
}
