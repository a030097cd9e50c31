// SPDX-License-Identifier: Apache-2.0
#include "support/cut_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "support/giop_message.h"
#include "support/silence.h"

namespace corbot::test {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool send_all(int to, const std::string& text) {
  const char* bytes = text.data();
  std::size_t count = text.size();
  while (count > 0) {
    const ssize_t sent = ::send(to, bytes, count, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes += sent;
    count -= static_cast<std::size_t>(sent);
  }
  return true;
}

}  // namespace

CutProxy::CutProxy(int server_port) : server_port_(server_port) {
  listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  if (::bind(listening_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listening_, 64) != 0 ||
      ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no port for the relay");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { run(); });
}

CutProxy::~CutProxy() {
  end_ = true;
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof(one));
  thread_.join();
  for (Line& line : lines_) end(line);
  ::close(listening_);
  ::close(wake_);
}

int CutProxy::requests(const std::string& operation) {
  const std::string text = operation + '\0';  // as it is sent, behind its length
  const auto count = [&](const std::string& bytes) {
    int found = 0;
    for (std::size_t at = bytes.find(text); at != std::string::npos; at = bytes.find(text, at + 1)) ++found;
    return found;
  };
  const std::lock_guard lock(mutex_);
  int all = count(sent_before_);
  for (const Line& line : lines_) all += count(line.sent);
  return all;
}

void CutProxy::cut() {
  const std::lock_guard lock(mutex_);
  for (Line& line : lines_) end(line);
  lines_.clear();
  holds_ = false;
}

void CutProxy::fall_silent() {
  const std::lock_guard lock(mutex_);
  for (Line& line : lines_) {
    if (!std::exchange(line.is_silent, true)) test::fall_silent(line.server);
  }
}

void CutProxy::cut_at(CutPoint point) {
  const std::lock_guard lock(mutex_);
  is_cut_ = false;
  point_ = std::move(point);
}

void CutProxy::run() {
  while (!end_) {
    std::vector<pollfd> polled{{listening_, POLLIN, 0}, {wake_, POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const Line& line : lines_) {
        polled.push_back({line.client, POLLIN, 0});
        polled.push_back({line.server, POLLIN, 0});
      }
    }
    ::poll(polled.data(), polled.size(), 5);
    const std::lock_guard lock(mutex_);
    std::erase_if(lines_, [&](Line& line) {
      const bool lives = relay(line, line.client) && relay(line, line.server);
      if (!lives) end(line);
      return !lives;
    });
    if ((polled[0].revents & POLLIN) != 0) take();
  }
}

void CutProxy::take() {
  const int client = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  Line line{client, ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  const sockaddr_in address = loopback(server_port_);
  const int on = 1;  // bytes go on as they come
  for (const int end : {line.client, line.server})
    (void)::setsockopt(end, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  if (::connect(line.server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    lines_.push_back(line);
  } else {
    end(line);
  }
}

bool CutProxy::relay(Line& line, int from) {
  char bytes[4096];
  const ssize_t count = ::recv(from, bytes, sizeof(bytes), MSG_DONTWAIT);
  if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK;
  if (count == 0) return false;
  if (from == line.server) {
    line.replies.append(bytes, static_cast<std::size_t>(count));
    return pass_replies(line);
  }
  line.sent.append(bytes, static_cast<std::size_t>(count));
  line.requests.append(bytes, static_cast<std::size_t>(count));
  return pass_requests(line);
}

bool CutProxy::pass_requests(Line& line) {
  if (!point_) return send_all(line.server, std::exchange(line.requests, {}));
  while (const auto message = take_message(line.requests)) {
    if (point_ && is_request_of(*message, point_->operation)) {
      if (point_->part == CutPoint::Part::kRequest) return cut_in(line, line.server, *message);
      line.is_reply_to_be_cut = true;
    }
    if (!send_all(line.server, *message)) return false;
  }
  return true;
}

bool CutProxy::pass_replies(Line& line) {
  while (const auto message = take_message(line.replies)) {
    if (is_forward(*message)) ++forwards_;
    if (is_reply(*message)) {
      ++replies_;
      if (point_ && line.is_reply_to_be_cut) return cut_in(line, line.client, *message);
    }
    if (!holds_ && !send_all(line.client, *message)) return false;
  }
  return true;
}

bool CutProxy::cut_in(Line& line, int to, const std::string& message) {
  const double passed = point_->share * static_cast<double>(message.size());
  (void)send_all(to, message.substr(0, static_cast<std::size_t>(passed)));
  line.resets = point_->resets;
  point_.reset();
  is_cut_ = true;
  return false;
}

void CutProxy::end(Line& line) {
  sent_before_ += line.sent;
  const linger reset{1, 0};
  for (const int fd : {line.client, line.server}) {
    if (line.resets) (void)::setsockopt(fd, SOL_SOCKET, SO_LINGER, &reset, sizeof(reset));
    ::close(fd);
  }
}

}  // namespace corbot::test
