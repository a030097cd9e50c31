// SPDX-License-Identifier: Apache-2.0
#include "panel/socket_session.h"

#include <utility>

namespace corbot::panel {

namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using nlohmann::json;

constexpr std::size_t kMostMessageBytes = 4096;
/// Limits the Stops in progress, and the replies to a browser that does not read: the oldest is forgotten.
constexpr std::size_t kMostReplies = 16;

std::shared_ptr<const std::string> text_of(const json& data) {
  return std::make_shared<const std::string>(data.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

SocketSession::SocketSession(Hub& hub, beast::tcp_stream stream)
    : hub_(hub), socket_(std::move(stream)), sent_(hub.watches.size()) {}

std::shared_ptr<SocketSession> SocketSession::self() {
  return std::static_pointer_cast<SocketSession>(shared_from_this());
}

void SocketSession::accept(const Request& request) {
  beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has time-outs of its own
  socket_.set_option(websocket::stream_base::timeout{hub_.settings.idle, hub_.settings.socket_idle, true});
  socket_.read_message_max(kMostMessageBytes);
  socket_.text(true);
  socket_.async_accept(request, [me = self()](beast::error_code error) {
    if (error) return;
    me->is_open_ = true;
    me->read();
    me->send_next();
  });
}

void SocketSession::close() {
  is_open_ = false;
  beast::get_lowest_layer(socket_).close();
}

void SocketSession::read() {
  socket_.async_read(buffer_, [me = self()](beast::error_code error, std::size_t) {
    if (error) return me->close();
    const std::string message = beast::buffers_to_string(me->buffer_.data());
    me->buffer_.clear();
    me->take(message);
    me->read();
  });
}

void SocketSession::take(const std::string& message) {
  const json wanted = json::parse(message, nullptr, false);
  Order order;
  if (wanted.is_object() && wanted.contains("stop")) order.stop = hub_.stop(wanted["stop"]);
  if (wanted.is_object()) order.id = wanted.value("id", json());
  if (order.stop.is_empty()) {
    reply({{"error",
            "write {\"stop\": {}}, or {\"stop\": {\"robot\": NAME}} with a robot of this panel, "
            "or \"cell\" with a cell; \"id\" is for the reply"}},
          order.id);
  } else {
    if (stops_.size() == kMostReplies) stops_.pop_front();
    stops_.push_back(std::move(order));
  }
  on_change();
}

void SocketSession::on_change() {
  for (auto order = stops_.begin(); order != stops_.end();) {
    const std::optional<json> result = order->stop.result();
    if (result) reply({{"stop", *result}}, order->id);
    order = result ? stops_.erase(order) : std::next(order);
  }
  send_next();
}

void SocketSession::reply(json text, const json& id) {
  if (!id.is_null()) text["id"] = id;
  if (replies_.size() == kMostReplies) replies_.pop_front();
  replies_.push_back(text_of(text));
}

std::shared_ptr<const std::string> SocketSession::next_text() {
  if (!replies_.empty()) {
    auto reply = std::move(replies_.front());
    replies_.pop_front();
    return reply;
  }
  for (std::size_t tried = 0; tried < sent_.size(); ++tried) {
    const std::size_t watch = turn_;
    turn_ = (turn_ + 1) % sent_.size();
    const Watch::State newest = hub_.watches[watch]->newest();
    if (newest.number != std::exchange(sent_[watch], newest.number)) return newest.text;
  }
  return nullptr;
}

void SocketSession::send_next() {
  if (!is_open_ || sending_) return;
  sending_ = next_text();
  if (!sending_) return;
  socket_.async_write(boost::asio::buffer(*sending_), [me = self()](beast::error_code error, std::size_t) {
    if (error) return me->close();
    me->sending_.reset();
    me->send_next();
  });
}

}  // namespace corbot::panel
