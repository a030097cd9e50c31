// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>
#include <string>

#include "panel/hub.h"

namespace corbot::panel {

/// An HTTP connection. It serves requests until one of them opens a WebSocket.
class HttpSession : public Session {
 public:
  HttpSession(Hub& hub, boost::asio::ip::tcp::socket socket);
  void start() { read(); }
  void on_change() override;
  void close() override;

 private:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using Status = boost::beast::http::status;

  void read();
  void on_read(boost::beast::error_code error);
  void respond(const Request& request);
  void respond_to_api(const Request& request, std::string_view path);
  void take_stop(const Request& request);
  void take_call(const Request& request);
  void take_program(const Request& request);
  void send_file(std::string_view path);
  void send_picture(std::string_view path);
  void open_socket(const Request& request);
  void refuse(Status status, const std::string& text);
  void refuse_body(std::size_t limit);
  /// Sends {"text": TEXT}.
  void refuse_call(Status status, const std::string& text);
  void send(Status status, const char* type, std::string body);
  /// Ends sending, and discards input until the browser closes the connection.
  void drain();
  [[nodiscard]] static std::string_view token_of(const Request& request);
  [[nodiscard]] bool may_watch(const Request& request) const;
  [[nodiscard]] bool may_drive(const Request& request) const;
  [[nodiscard]] std::shared_ptr<HttpSession> self();

  Hub& hub_;
  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  bool keep_alive_{false};
  std::optional<StopOrder> stop_;            // its result is the response
  std::shared_ptr<const Watch::Call> call_;  // its result is the response
  std::array<char, 1024> drained_{};
};

}  // namespace corbot::panel
