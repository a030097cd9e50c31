// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panel/hub.h"

namespace corbot::panel {

/// A WebSocket: sends the newest states, one text at a time, and takes Stops. A browser that reads slowly misses states, and holds up
/// nobody else.
class SocketSession : public Session {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  SocketSession(Hub& hub, boost::beast::tcp_stream stream);
  /// Answers the request for a WebSocket, which has been checked.
  void accept(const Request& request);
  void on_change() override;
  void close() override;

 private:
  void read();
  void take(const std::string& message);
  void send_next();
  /// The text to send now, null where there is none: a reply before all states, and the robots in turn.
  [[nodiscard]] std::shared_ptr<const std::string> next_text();
  [[nodiscard]] std::shared_ptr<SocketSession> self();

  Hub& hub_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::beast::flat_buffer buffer_;
  bool is_open_{false};
  std::shared_ptr<const std::string> sending_;
  std::vector<std::uint64_t> sent_;  // for each robot the number of its state
  std::size_t turn_{0};              // of a robot
  std::optional<StopOrder> stop_;    // whose result is to be sent; a newer one replaces it
  std::shared_ptr<const std::string> reply_;
};

}  // namespace corbot::panel
