// SPDX-License-Identifier: Apache-2.0
#include "cell/scene/picture_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

#include "cell/picture_wire.h"
#include "cell/wall_clock.h"
#include "sim/devices/control_input.h"

namespace corbot::cell {
namespace {

constexpr std::size_t kMostClients = 8;
constexpr std::int64_t kTakeWithin_ns = 2'000'000'000;
/// The period in which a wait checks for a requested stop.
constexpr int kLook_ms = 100;

}  // namespace

PictureServer::PictureServer(const std::filesystem::path& socket, std::array<int, 2> size_px, Look look,
                             Draw draw)
    : listener_(socket, SOCK_STREAM, 0600),
      size_px_(size_px),
      look_(std::move(look)),
      draw_(std::move(draw)) {}

PictureServer::~PictureServer() {
  for (const int client : clients_) ::close(client);
}

void PictureServer::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<pollfd> fds{{listener_.fd(), POLLIN, 0}};
    for (const int client : clients_) fds.push_back({client, POLLIN, 0});
    if (::poll(fds.data(), fds.size(), kLook_ms) <= 0) continue;
    serve_all(fds, stop);
    if (fds[0].revents == 0 || (clients_.size() >= kMostClients && !make_room())) continue;
    const int next = listener_.accept();
    if (next >= 0) clients_.push_back(next);
  }
}

void PictureServer::serve_all(const std::vector<pollfd>& ready, const std::stop_token& stop) {
  std::vector<int> served;
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    if (ready[i + 1].revents == 0) continue;
    const int client = std::exchange(clients_[i], -1);
    if (serve(client, stop)) {
      served.push_back(client);
    } else {
      ::close(client);
    }
  }
  clients_.erase(std::remove(clients_.begin(), clients_.end(), -1), clients_.end());
  clients_.insert(clients_.end(), served.begin(), served.end());
}

bool PictureServer::make_room() {
  // A client with a waiting request is not idle: it is served next.
  const auto is_idle = [](int client) {
    char byte = 0;
    return ::recv(client, &byte, 1, MSG_PEEK | MSG_DONTWAIT) <= 0;
  };
  const auto idle = std::find_if(clients_.begin(), clients_.end(), is_idle);
  if (idle == clients_.end()) return false;
  ::close(*idle);
  clients_.erase(idle);
  return true;
}

bool PictureServer::serve(int client, const std::stop_token& stop) {
  std::uint8_t trigger = 0;
  const ssize_t n = ::recv(client, &trigger, 1, MSG_DONTWAIT);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) return false;
  const std::optional<SceneView> view = look_();
  if (!view) return false;
  PictureHeader header;
  header.columns = static_cast<std::uint32_t>(size_px_[0]);
  header.rows = static_cast<std::uint32_t>(size_px_[1]);
  header.number = ++number_;
  header.exposure_s = now_s();
  const std::vector<std::uint8_t>& pixels = draw_(*view);
  const std::int64_t deadline_ns = sim::clock_ns() + kTakeWithin_ns;
  return send_all(client, {reinterpret_cast<const std::uint8_t*>(&header), sizeof(header)}, deadline_ns,
                  stop) &&
         send_all(client, pixels, deadline_ns, stop);
}

bool PictureServer::send_all(int client, std::span<const std::uint8_t> bytes, std::int64_t deadline_ns,
                             const std::stop_token& stop) {
  while (!bytes.empty()) {
    const ssize_t n = ::send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(n));
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (stop.stop_requested() || sim::clock_ns() >= deadline_ns) return false;
    pollfd ready{client, POLLOUT, 0};
    (void)::poll(&ready, 1, kLook_ms);
  }
  return true;
}

}  // namespace corbot::cell
