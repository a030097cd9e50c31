// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "support/paths.h"

// Sends a panel the requests of a browser, and requests that no browser sends.

namespace corbot::panel {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Response = http::response<http::string_body>;

inline constexpr const char* kToken = "0123456789abcdef";
inline constexpr std::chrono::seconds kDeadline{30};

/// Passes a handler to `start` and waits until the operation calls it. Returns its error, or timeout.
template <class Start>
beast::error_code finish(asio::io_context& io, Start&& start) {
  beast::error_code result = beast::error::timeout;
  start([&](beast::error_code error, std::size_t = 0) { result = error; });
  io.restart();
  io.run_for(kDeadline);
  return result;
}

/// A connection that sends one request after another.
class Browser {
 public:
  explicit Browser(int port) {
    stream_.connect({asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)});
  }

  [[nodiscard]] static http::request<http::string_body> request(http::verb verb, const std::string& target) {
    http::request<http::string_body> request{verb, target, 11};
    request.set(http::field::host, "localhost");
    request.set(http::field::authorization, std::string("Bearer ") + kToken);
    return request;
  }
  Response get(const std::string& target) { return ask(request(http::verb::get, target)); }
  Response post(const std::string& target, const std::string& body = "") {
    auto wanted = request(http::verb::post, target);
    wanted.body() = body;
    return ask(std::move(wanted));
  }
  Response ask(http::request<http::string_body> request) {
    request.prepare_payload();
    beast::error_code error;
    http::write(stream_, request, error);
    return read();
  }
  Response send_bytes(const std::string& bytes) {
    beast::error_code error;
    asio::write(stream_, asio::buffer(bytes), error);
    return read();
  }
  Response read() {
    Response response;
    const beast::error_code error =
        finish(io_, [&](auto handler) { http::async_read(stream_, buffer_, response, handler); });
    if (error) response.result(0);
    return response;
  }
  /// Returns whether the server closes the connection.
  [[nodiscard]] bool is_closed() {
    char byte = 0;
    const beast::error_code error =
        finish(io_, [&](auto handler) { stream_.async_read_some(asio::buffer(&byte, 1), handler); });
    return error == asio::error::eof || error == asio::error::connection_reset;
  }

 private:
  asio::io_context io_;
  beast::tcp_stream stream_{io_};
  beast::flat_buffer buffer_;
};

/// A page's end of a WebSocket.
class Page {
 public:
  /// Connects. error() is empty after a success.
  explicit Page(int port, const std::string& target = std::string("/ws?token=") + kToken,
                const std::string& origin = "http://localhost") {
    auto& socket = beast::get_lowest_layer(stream_).socket();
    socket.open(asio::ip::tcp::v4());
    socket.set_option(asio::socket_base::receive_buffer_size(16'384));
    socket.connect({asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)});
    stream_.set_option(beast::websocket::stream_base::decorator(
        [&](beast::websocket::request_type& request) { request.set(http::field::origin, origin); }));
    error_ =
        finish(io_, [&](auto handler) { stream_.async_handshake(response_, "localhost", target, handler); });
  }
  [[nodiscard]] beast::error_code error() const { return error_; }
  [[nodiscard]] http::status refusal() const { return response_.result(); }

  void send(const std::string& text) {
    beast::error_code error;
    stream_.write(asio::buffer(text), error);
  }
  /// Returns the next text; null after an error.
  nlohmann::json read() {
    beast::flat_buffer buffer;
    const beast::error_code error = finish(io_, [&](auto handler) { stream_.async_read(buffer, handler); });
    return error ? nlohmann::json() : nlohmann::json::parse(beast::buffers_to_string(buffer.data()));
  }
  /// Returns the next text that has the key; null after an error.
  nlohmann::json read_until(const std::string& key) {
    for (;;) {
      nlohmann::json text = read();
      if (text.is_null() || text.contains(key)) return text;
    }
  }

 private:
  asio::io_context io_;
  beast::websocket::stream<beast::tcp_stream> stream_{io_};
  beast::websocket::response_type response_;
  beast::error_code error_;
};

}  // namespace corbot::panel
