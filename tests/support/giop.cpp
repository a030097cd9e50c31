// SPDX-License-Identifier: Apache-2.0
#include "support/giop.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "support/silence.h"

namespace corbot::test {
namespace {

constexpr std::size_t kHeader = 12;

/// CDR, little-endian; alignment counts from the message's start.
class Writer {
 public:
  void u32(std::uint32_t value) { number(value); }
  void f64(double value) { number(value); }
  void octet(std::uint8_t value) { body_.push_back(static_cast<char>(value)); }
  void bytes(const std::string& value) {
    u32(static_cast<std::uint32_t>(value.size()));
    body_ += value;
  }
  void text(const std::string& value) { bytes(value + '\0'); }
  [[nodiscard]] const std::string& body() const { return body_; }

 private:
  template <class Number>
  void number(Number value) {
    while ((kHeader + body_.size()) % sizeof(Number) != 0) body_.push_back('\0');
    char raw[sizeof(Number)];
    std::memcpy(raw, &value, sizeof(Number));
    body_.append(raw, sizeof(Number));
  }
  std::string body_;
};

std::uint32_t u32_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (at + sizeof(value) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

/// A counted string or sequence of octets, and the place behind it, aligned to 4.
std::string counted(const std::string& bytes, std::size_t& at) {
  at = (at + 3) / 4 * 4;
  const std::size_t length = u32_at(bytes, at);
  const std::string value = at + 4 <= bytes.size() ? bytes.substr(at + 4, length) : "";
  at += 4 + length;
  return value;
}

}  // namespace

std::string giop_header(std::uint8_t type, std::size_t size, bool more_fragments, std::uint8_t minor) {
  std::string header("GIOP");
  header +=
      {'\1', static_cast<char>(minor), static_cast<char>(more_fragments ? 3 : 1), static_cast<char>(type)};
  const auto length = static_cast<std::uint32_t>(size);
  header.append(reinterpret_cast<const char*>(&length), sizeof(length));
  return header;
}

std::string giop_request(std::uint32_t id, const std::string& key, const std::string& operation,
                         const std::vector<double>& arguments) {
  Writer writer;
  writer.u32(0);  // service contexts
  writer.u32(id);
  writer.octet(1);  // response expected
  writer.bytes(key);
  writer.text(operation);
  writer.u32(0);  // principal
  for (const double argument : arguments) writer.f64(argument);
  return giop_header(0, writer.body().size()) + writer.body();
}

GiopFragments giop_fragments(std::uint32_t id, const std::string& key, const std::string& operation,
                             const std::vector<double>& arguments, std::size_t first) {
  constexpr std::uint8_t kFragment = 7;
  constexpr std::uint8_t kMinor = 2;
  Writer writer;
  writer.u32(id);
  writer.u32(3);  // response expected, and three octets that are reserved
  writer.u32(0);  // what follows is an object key
  writer.bytes(key);
  writer.text(operation);
  writer.u32(0);  // service contexts
  for (const double argument : arguments) writer.f64(argument);
  const std::string begin = writer.body().substr(0, first);
  Writer number;
  number.u32(id);
  const std::string end = number.body() + writer.body().substr(first);
  return {giop_header(0, begin.size(), true, kMinor) + begin,
          giop_header(kFragment, end.size(), false, kMinor) + end};
}

RawConnection::RawConnection(int port) {
  fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd_ >= 0 && ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    ::close(std::exchange(fd_, -1));
  }
  const int on = 1;  // as an ORB does; else a second request waits for the first one's acknowledgement
  (void)::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
}

RawConnection::RawConnection(RawConnection&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), received_(std::move(other.received_)) {}

RawConnection::~RawConnection() { close(); }

void RawConnection::close() {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

void RawConnection::reset() {
  const linger at_once{1, 0};
  (void)::setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  close();
}

void RawConnection::fall_silent() { test::fall_silent(fd_); }

int RawConnection::local_port() const {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  if (::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

bool RawConnection::send(const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::send(fd_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

bool RawConnection::read_more(Deadline deadline) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() < 0) return false;
    pollfd ready{fd_, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(left.count()) + 1) <= 0) continue;
    char buffer[65536];
    const ssize_t n = ::recv(fd_, buffer, sizeof(buffer), 0);
    if (n <= 0) return false;
    received_.append(buffer, static_cast<std::size_t>(n));
    return true;
  }
}

std::optional<GiopReply> RawConnection::reply(Deadline deadline) {
  constexpr char kReply = 1;
  for (;;) {
    while (received_.size() < kHeader || received_.size() < kHeader + u32_at(received_, 8)) {
      if (!read_more(deadline)) return std::nullopt;
    }
    const std::size_t size = kHeader + u32_at(received_, 8);
    const std::string message = received_.substr(0, size);
    received_.erase(0, size);
    if (message[7] != kReply) continue;
    const bool is_1_2 = message[5] >= 2;
    if (is_1_2)
      return GiopReply{u32_at(message, kHeader), u32_at(message, kHeader + 4), message.substr(kHeader + 8)};
    // Service contexts: none is needed.
    std::size_t at = kHeader + 4;
    for (std::uint32_t left = u32_at(message, kHeader); left > 0; --left) {
      at = (at + 3) / 4 * 4 + 4;
      (void)counted(message, at);
    }
    at = (at + 3) / 4 * 4;
    return GiopReply{u32_at(message, at), u32_at(message, at + 4),
                     message.substr(std::min(at + 8, message.size()))};
  }
}

bool RawConnection::closed(Deadline deadline) {
  while (std::chrono::steady_clock::now() < deadline) {
    pollfd ready{fd_, POLLIN, 0};
    if (::poll(&ready, 1, 20) <= 0) continue;
    char buffer[65536];
    if (::recv(fd_, buffer, sizeof(buffer), 0) <= 0) return true;
  }
  return false;
}

}  // namespace corbot::test
