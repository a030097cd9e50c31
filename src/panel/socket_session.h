// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "panel/hub.h"

namespace corbot::panel {

/// A WebSocket that sends the newest states, one text at a time, and accepts Stops. Each Stop has a reply. A
/// browser that reads slowly misses states, and delays no other one.
class SocketSession : public Session {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  SocketSession(Hub& hub, boost::beast::tcp_stream stream);
  /// Accepts a request for a WebSocket that the caller has checked.
  void accept(const Request& request);
  void on_change() override;
  void close() override;

 private:
  /// A Stop, and the member "id" of its message, null without one.
  struct Order {
    nlohmann::json id;
    StopOrder stop;
  };

  void read();
  void take(const std::string& message);
  void send_next();
  void reply(nlohmann::json text, const nlohmann::json& id);
  /// Returns the text to send now, or null if there is none. Replies precede states; the robots take turns.
  [[nodiscard]] std::shared_ptr<const std::string> next_text();
  [[nodiscard]] std::shared_ptr<SocketSession> self();

  Hub& hub_;
  boost::beast::websocket::stream<boost::beast::tcp_stream, false> socket_;  // does not compress
  boost::beast::flat_buffer buffer_;
  bool is_open_{false};
  std::shared_ptr<const std::string> sending_;
  std::vector<std::uint64_t> sent_;  // for each watch, the number of the state that was sent last
  std::size_t turn_{0};              // index of the watch whose state is next
  std::deque<Order> stops_;          // their results are to be sent
  std::deque<std::shared_ptr<const std::string>> replies_;
};

}  // namespace corbot::panel
