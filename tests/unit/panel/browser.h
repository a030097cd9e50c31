// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/beast/http/status.hpp>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/paths.h"

// Sends a panel the requests of a browser, and requests that no browser sends. The client is plain sockets:
// the panel's own library at both ends would agree with itself, and would take most of the time to compile.

namespace corbot::panel {

namespace http = boost::beast::http;

inline constexpr const char* kToken = "0123456789abcdef";
inline constexpr std::chrono::seconds kDeadline{30};

/// Header fields in their order. Names are the same in any case of letters.
class Fields {
 public:
  /// Replaces all fields of this name.
  void set(const std::string& name, const std::string& value) {
    std::erase_if(all_, [&](const auto& field) { return is(field.first, name); });
    insert(name, value);
  }
  void insert(const std::string& name, const std::string& value) { all_.emplace_back(name, value); }
  /// Returns the value, empty without such a field.
  [[nodiscard]] std::string operator[](const std::string& name) const {
    const auto found =
        std::find_if(all_.begin(), all_.end(), [&](const auto& field) { return is(field.first, name); });
    return found == all_.end() ? "" : found->second;
  }
  [[nodiscard]] std::string text() const {
    std::string text;
    for (const auto& [name, value] : all_) text.append(name).append(": ").append(value).append("\r\n");
    return text;
  }

 private:
  static bool is(const std::string& a, const std::string& b) {
    return ::strcasecmp(a.c_str(), b.c_str()) == 0;
  }
  std::vector<std::pair<std::string, std::string>> all_;
};

struct Request : Fields {
  Request(const std::string& verb, const std::string& target) : line(verb + " " + target + " HTTP/1.1\r\n") {}
  [[nodiscard]] std::string text() const {
    const std::string length = "Content-Length: " + std::to_string(body.size()) + "\r\n";
    return line + Fields::text() + (line.starts_with("GET") ? "" : length) + "\r\n" + body;
  }
  std::string line;
  std::string body;
};

/// The status is unknown if no whole response came.
class Response : public Fields {
 public:
  Response() = default;
  Response(http::status result, Fields fields, std::string body)
      : Fields(std::move(fields)), result_(result), body_(std::move(body)) {}
  [[nodiscard]] http::status result() const { return result_; }
  [[nodiscard]] const std::string& body() const { return body_; }

 private:
  http::status result_{http::status::unknown};
  std::string body_;
};

/// A connection to a port of the loopback. A read ends without bytes at the other end's close, or after
/// kDeadline.
class Connection {
 public:
  /// `buffer_bytes` limits the bytes that the kernel keeps before a read.
  explicit Connection(int port, std::optional<int> buffer_bytes = {}) {
    if (buffer_bytes) ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &*buffer_bytes, sizeof *buffer_bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << port;
    const timeval deadline{.tv_sec = kDeadline.count(), .tv_usec = 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &deadline, sizeof deadline);
    ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &deadline, sizeof deadline);
  }
  ~Connection() { ::close(fd_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t count =
          retried([&] { return ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL); });
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }
  /// Takes this number of bytes. Returns nothing if they did not come.
  std::optional<std::string> take(std::size_t count) {
    while (received_.size() < count)
      if (!receive()) return {};
    std::string taken = received_.substr(0, count);
    received_.erase(0, count);
    return taken;
  }
  /// Takes the header and the body of a response.
  Response response() {
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos)
      if (!receive()) return {};
    const std::string header = take(end + 4).value();
    const auto status = header.starts_with("HTTP/1.1 ") ? number(header.substr(9, 3)) : std::nullopt;
    Fields fields;
    for (std::size_t at = header.find("\r\n") + 2; at < end; at = header.find("\r\n", at) + 2) {
      const std::string line = header.substr(at, header.find("\r\n", at) - at);
      const std::size_t colon = line.find(": ");
      if (colon == std::string::npos) return {};
      fields.insert(line.substr(0, colon), line.substr(colon + 2));
    }
    const bool has_body = status != 101;
    const auto length = has_body ? number(fields["Content-Length"]) : std::size_t{0};
    if (!status || !length) return {};
    const auto body = take(*length);
    if (!body) return {};
    return {http::int_to_status(static_cast<unsigned>(*status)), fields, *body};
  }
  /// Returns whether the other end closes the connection.
  [[nodiscard]] bool is_closed() {
    char byte = 0;
    const ssize_t count = retried([&] { return ::recv(fd_, &byte, 1, 0); });
    return count == 0 || (count < 0 && errno == ECONNRESET);
  }

 private:
  static std::optional<std::size_t> number(const std::string& text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return {};
    return value;
  }
  /// A call with a deadline is interrupted if the process is stopped and goes on.
  template <class Call>
  static ssize_t retried(Call&& call) {
    ssize_t count = 0;
    do count = call();
    while (count < 0 && errno == EINTR);
    return count;
  }
  bool receive() {
    std::array<char, 4096> bytes{};
    const ssize_t count = retried([&] { return ::recv(fd_, bytes.data(), bytes.size(), 0); });
    // After a failure part of a frame may be gone, so nothing more is read.
    has_failed_ = has_failed_ || count <= 0;
    if (!has_failed_) received_.append(bytes.data(), static_cast<std::size_t>(count));
    return !has_failed_;
  }
  int fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string received_;
  bool has_failed_ = false;
};

/// A connection that sends one request after another.
class Browser {
 public:
  explicit Browser(int port) : connection_(port) {}

  [[nodiscard]] static Request request(const std::string& verb, const std::string& target) {
    Request request(verb, target);
    request.set("Host", "localhost");
    request.set("Authorization", std::string("Bearer ") + kToken);
    return request;
  }
  Response get(const std::string& target) { return ask(request("GET", target)); }
  Response post(const std::string& target, const std::string& body = "") {
    Request wanted = request("POST", target);
    wanted.body = body;
    return ask(wanted);
  }
  Response ask(const Request& request) { return send_bytes(request.text()); }
  Response send_bytes(const std::string& bytes) {
    connection_.send(bytes);
    return connection_.response();
  }
  [[nodiscard]] bool is_closed() { return connection_.is_closed(); }

 private:
  Connection connection_;
};

/// A page's end of a WebSocket, RFC 6455.
class Page {
 public:
  /// Connects. error() is false after a success.
  explicit Page(int port, const std::string& target = std::string("/ws?token=") + kToken,
                const std::string& origin = "http://localhost")
      : connection_(port, 16'384) {
    Request request("GET", target);
    request.set("Host", "localhost");
    request.set("Upgrade", "websocket");
    request.set("Connection", "Upgrade");
    request.set("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");  // and its reply, of RFC 6455, 1.3
    request.set("Sec-WebSocket-Version", "13");
    request.set("Origin", origin);
    connection_.send(request.text());
    const Response response = connection_.response();
    refusal_ = response.result();
    error_ = refusal_ != http::status::switching_protocols ||
             response["Sec-WebSocket-Accept"] != "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=";
  }
  [[nodiscard]] bool error() const { return error_; }
  [[nodiscard]] http::status refusal() const { return refusal_; }

  void send(const std::string& text) { send_frame(kText, text); }
  /// Returns the next text; null after an error, or if pings alone come until kDeadline.
  nlohmann::json read() {
    std::string text;
    const auto end = std::chrono::steady_clock::now() + kDeadline;
    while (std::chrono::steady_clock::now() < end) {
      const auto frame = take_frame();
      if (!frame || frame->opcode == kClose) return {};
      if (frame->opcode == kPing) {
        send_frame(kPong, frame->bytes);
      } else if (frame->opcode != kPong) {
        text += frame->bytes;
        if (frame->is_last) return nlohmann::json::parse(text);
      }
    }
    return {};
  }
  /// Returns the next text that has the key; null after an error.
  nlohmann::json read_until(const std::string& key) {
    for (;;) {
      nlohmann::json text = read();
      if (text.is_null() || text.contains(key)) return text;
    }
  }

 private:
  static constexpr unsigned kText = 1, kClose = 8, kPing = 9, kPong = 10;
  struct Frame {
    unsigned opcode;
    bool is_last;
    std::string bytes;
  };

  static std::string big_endian(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xff);
    return text;
  }
  /// Sends up to 65,535 bytes. A client's frame has a mask, which is zero here: the bytes stay as they are.
  void send_frame(unsigned opcode, const std::string& bytes) {
    const bool is_short = bytes.size() < 126;
    connection_.send(big_endian(0x80 | opcode, 1) + big_endian(0x80 | (is_short ? bytes.size() : 126), 1) +
                     (is_short ? "" : big_endian(bytes.size(), 2)) + big_endian(0, 4) + bytes);
  }
  std::optional<std::uint64_t> take_number(std::size_t bytes) {
    const auto taken = connection_.take(bytes);
    if (!taken) return {};
    std::uint64_t value = 0;
    for (const char byte : *taken) value = value << 8 | static_cast<unsigned char>(byte);
    return value;
  }
  std::optional<Frame> take_frame() {
    const auto head = take_number(2);
    if (!head) return {};
    std::optional<std::uint64_t> size = *head & 0x7f;
    if (*size == 126) {
      size = take_number(2);
    } else if (*size == 127) {
      size = take_number(8);
    }
    if (!size) return {};
    auto bytes = connection_.take(*size);
    if (!bytes) return {};
    return Frame{static_cast<unsigned>(*head >> 8 & 0xf), (*head & 0x8000) != 0, std::move(*bytes)};
  }

  Connection connection_;
  http::status refusal_{http::status::unknown};
  bool error_ = true;
};

}  // namespace corbot::panel
