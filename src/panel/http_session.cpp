// SPDX-License-Identifier: Apache-2.0
#include "panel/http_session.h"

#include <algorithm>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <utility>

#include "client/failure.h"
#include "panel/access.h"
#include "panel/call_request.h"
#include "panel/program_request.h"
#include "panel/socket_session.h"

namespace corbot::panel {

namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using nlohmann::json;

constexpr unsigned kMostHeaderBytes = 8192;
constexpr std::size_t kMostBodyBytes = 4096;
/// A browser that has not read a response within this time loses its connection.
constexpr std::chrono::seconds kResponseTimeout{60};
constexpr const char* kText = "text/plain; charset=utf-8";
constexpr const char* kJson = "application/json";
constexpr std::string_view kCells = "/api/cells/";
constexpr std::string_view kPicture = "/picture";
constexpr std::string_view kProgram = "/api/program";
constexpr const char* kOvertaken = "a Stop came before it arrived; send it again if the arm may move";
constexpr const char* kNoStops = "stops must be the number in the newest state";
constexpr const char* kMayNotDrive = "this token allows to watch and to stop: open the URL to drive";
/// The page runs only its own scripts, connects only to this server, and cannot be embedded in another page.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; font-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

std::string dump(const json& data) { return data.dump(-1, ' ', false, json::error_handler_t::replace); }

/// Returns whether a request comes from another page or uses a host name that is not allowed.
bool is_foreign(const http::fields& fields, const std::vector<std::string>& more_hosts) {
  const std::string_view host = view(fields[http::field::host]);
  if (fields.count(http::field::host) != 1 || !is_host_allowed(host, more_hosts)) return true;
  const std::size_t origins = fields.count(http::field::origin);
  return origins > 1 || (origins == 1 && !is_same_origin(view(fields[http::field::origin]), host));
}

/// Removes the number of Stops that the sender knew. Returns nothing if it is no such number, else whether a
/// Stop has come since.
std::optional<bool> is_overtaken(const Hub& hub, json& body) {
  const auto known = body.find("stops");
  if (known == body.end()) return false;
  if (!known->is_number_unsigned()) return std::nullopt;
  const bool is_overtaken = *known != hub.received_stops.load();
  body.erase(known);
  return is_overtaken;
}

}  // namespace

HttpSession::HttpSession(Hub& hub, boost::asio::ip::tcp::socket socket)
    : hub_(hub), stream_(std::move(socket)), buffer_(2 * kMostHeaderBytes) {}

std::shared_ptr<HttpSession> HttpSession::self() {
  return std::static_pointer_cast<HttpSession>(shared_from_this());
}

void HttpSession::close() { stream_.close(); }

void HttpSession::read() {
  parser_.emplace();
  parser_->header_limit(kMostHeaderBytes);
  parser_->body_limit(kMostProgramBodyBytes);
  begin_idle();
  stream_.expires_after(hub_.settings.idle);
  http::async_read(stream_, buffer_, *parser_,
                   [me = self()](beast::error_code error, std::size_t) { me->on_read(error); });
}

void HttpSession::on_read(beast::error_code error) {
  keep_alive_ = false;
  if (error == http::error::end_of_stream) return drain();
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return refuse(Status::request_header_fields_too_large, "the header is too large");
  if (error == http::error::body_limit) return refuse_body(kMostProgramBodyBytes);
  if (error && error.category() == http::make_error_code(http::error::bad_method).category())
    return refuse(Status::bad_request, "this is not an HTTP request");
  if (error) return;  // closed, or idle for too long
  const Request request = parser_->release();
  keep_alive_ = request.keep_alive();
  respond(request);
}

void HttpSession::respond(const Request& request) {
  if (is_foreign(request, hub_.settings.more_hosts))
    return refuse(Status::forbidden, "this host name or origin is not allowed here");
  const std::string_view target = view(request.target());
  const std::string_view path = target.substr(0, target.find('?'));
  if (path != kProgram && request.body().size() > kMostBodyBytes) return refuse_body(kMostBodyBytes);
  if (path == "/ws" || path.starts_with("/api/")) {
    if (!may_watch(request)) return refuse(Status::unauthorized, "the token is missing or wrong");
    return respond_to_api(request, path);
  }
  if (request.method() != http::verb::get) return refuse(Status::method_not_allowed, "files are read by GET");
  send_file(path);
}

void HttpSession::respond_to_api(const Request& request, std::string_view path) {
  const bool is_get = request.method() == http::verb::get;
  if (path == "/ws" && is_get) return open_socket(request);
  if (path == "/api/robots" && is_get)
    return send(Status::ok, kJson, dump(hub_.descriptions(Watched::kRobot)));
  if (path == "/api/cells" && is_get) return send(Status::ok, kJson, dump(hub_.descriptions(Watched::kCell)));
  if (path.starts_with(kCells) && path.ends_with(kPicture) && is_get) return send_picture(path);
  if (path == "/api/rights" && is_get) return send(Status::ok, kJson, dump({{"drive", may_drive(request)}}));
  const bool is_post = request.method() == http::verb::post;
  if (path == "/api/stop" && is_post) return take_stop(request);
  if (path == "/api/call" && is_post) return take_call(request);
  if (path == kProgram && is_post) return take_program(request);
  refuse(Status::not_found,
         "there is GET /ws, /api/robots, /api/cells, /api/cells/NAME/picture and /api/rights, and POST "
         "/api/stop, /api/call and /api/program");
}

void HttpSession::take_stop(const Request& request) {
  StopOrder order =
      hub_.stop(request.body().empty() ? json::object() : json::parse(request.body(), nullptr, false));
  if (order.is_empty())
    return refuse(Status::bad_request,
                  "write nothing, {}, {\"robot\": NAME} with a robot of this panel, or {\"cell\": NAME} "
                  "with a cell of it");
  stop_ = std::move(order);
  end_idle();
  stream_.expires_never();  // the time-out of the robot's port limits each Stop
  on_change();
}

void HttpSession::take_call(const Request& request) {
  if (!may_drive(request)) return refuse(Status::forbidden, kMayNotDrive);
  json body = json::parse(request.body(), nullptr, false);
  Watch* const watch = hub_.find(body);
  if (watch == nullptr)
    return refuse_call(Status::bad_request,
                       "write {\"robot\": NAME, \"do\": …} with a robot of this panel, or {\"cell\": NAME, "
                       "\"do\": …} with a cell of it");
  const auto was_overtaken = is_overtaken(hub_, body);
  if (!was_overtaken) return refuse_call(Status::bad_request, kNoStops);
  try {
    Order order = watch->is_for(Watched::kCell) ? Order(cell_request(body)) : Order(call_request(body));
    if (*was_overtaken && starts_motion(order)) return refuse_call(Status::conflict, kOvertaken);
    call_ = watch->request_call(std::move(order));
  } catch (const client::Failure& failure) {
    return refuse_call(Status::bad_request, failure.what());
  }
  if (!call_) return refuse_call(Status::conflict, "busy: another call to this robot or cell is in progress");
  end_idle();
  stream_.expires_never();  // the time-out of the robot's port limits the call
  on_change();
}

void HttpSession::take_program(const Request& request) {
  if (!may_drive(request)) return refuse(Status::forbidden, kMayNotDrive);
  json body = json::parse(request.body(), nullptr, false);
  Watch* const watch = hub_.find(body);
  if (watch == nullptr || !watch->is_for(Watched::kRobot))
    return refuse_call(
        Status::bad_request,
        "write {\"robot\": NAME, \"name\": FILE, \"text\": PROGRAM} with a robot of this panel");
  const auto was_overtaken = is_overtaken(hub_, body);
  if (!was_overtaken) return refuse_call(Status::bad_request, kNoStops);
  if (*was_overtaken) return refuse_call(Status::conflict, kOvertaken);
  try {
    client::Program program = program_request(body);
    const std::size_t count = program.statements.size();
    if (!watch->start_program(std::move(program)))
      return refuse_call(Status::conflict, "busy: a program runs on this robot; stop it first");
    send(Status::ok, kJson, dump({{"done", true}, {"commands", count}}));
  } catch (const client::Failure& failure) {
    refuse_call(Status::bad_request, failure.what());
  }
}

void HttpSession::on_change() {
  if (!stream_.socket().is_open()) return;  // a newer connection has replaced this one
  if (call_) {
    if (!call_->has_ended) return hub_.hold(self());
    const auto call = std::exchange(call_, nullptr);
    if (!call->failure.empty()) return refuse_call(Status::conflict, call->failure);
    return send(Status::ok, kJson, dump(call->reply));
  }
  const std::optional<json> result = stop_ ? stop_->result() : std::nullopt;
  if (!result) return hub_.hold(self());
  stop_.reset();
  bool all_stopped = true;
  for (const json& list : *result)
    for (const json& one : list) all_stopped = all_stopped && one.at("stopped");
  send(all_stopped ? Status::ok : Status::bad_gateway, kJson, dump(*result));
}

void HttpSession::send_file(std::string_view path) {
  const PageFiles::File* file = hub_.pages.find(path);
  if (file == nullptr) return refuse(Status::not_found, "there is no such file");
  send(Status::ok, file->type, file->bytes);
}

void HttpSession::send_picture(std::string_view path) {
  path.remove_prefix(kCells.size());
  path.remove_suffix(std::min(path.size(), kPicture.size()));
  const Watch* const cell = hub_.find({{"cell", path}});
  if (cell == nullptr) return refuse(Status::not_found, "the panel watches no cell of this name");
  const auto picture = cell->picture();
  if (!picture) return refuse(Status::not_found, "the camera has given no picture");
  send(Status::ok, "image/jpeg", *picture);
}

void HttpSession::open_socket(const Request& request) {
  if (!beast::websocket::is_upgrade(request))
    return refuse(Status::bad_request, "this is not a request for a WebSocket");
  if (!hub_.has_room_for_socket())
    return refuse(Status::service_unavailable, "too many browsers watch: close one");
  const auto socket = std::make_shared<SocketSession>(hub_, std::move(stream_));
  hub_.add_socket(socket);
  socket->accept(request);
}

void HttpSession::refuse(Status status, const std::string& text) { send(status, kText, text + "\n"); }

void HttpSession::refuse_body(std::size_t limit) {
  refuse(Status::payload_too_large, "the body is larger than " + std::to_string(limit) + " bytes");
}

void HttpSession::refuse_call(Status status, const std::string& text) {
  send(status, kJson, dump({{"text", text}}));
}

void HttpSession::send(Status status, const char* type, std::string body) {
  const auto response = std::make_shared<http::response<http::string_body>>();
  response->result(status);
  response->set(http::field::content_type, type);
  response->set(http::field::cache_control, "no-store");
  response->set("Content-Security-Policy", kContentPolicy);
  response->set("Cross-Origin-Resource-Policy", "same-origin");
  response->set("Referrer-Policy", "no-referrer");
  response->set("X-Content-Type-Options", "nosniff");
  response->keep_alive(keep_alive_);
  response->body() = std::move(body);
  response->prepare_payload();
  begin_idle();
  stream_.expires_after(kResponseTimeout);
  http::async_write(stream_, *response, [me = self(), response](beast::error_code error, std::size_t) {
    if (error) return;
    if (me->keep_alive_) return me->read();
    me->drain();
  });
}

void HttpSession::drain() {
  beast::error_code ignored;
  stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  stream_.async_read_some(boost::asio::buffer(drained_), [me = self()](beast::error_code error, std::size_t) {
    if (!error) me->drain();
  });
}

std::string_view HttpSession::token_of(const Request& request) {
  const std::string_view token = bearer_token(view(request[http::field::authorization]));
  return token.empty() ? query_value(view(request.target()), "token") : token;
}

bool HttpSession::may_watch(const Request& request) const {
  return is_token(token_of(request), hub_.settings.watch_token) || may_drive(request);
}

bool HttpSession::may_drive(const Request& request) const {
  return is_token(token_of(request), hub_.settings.drive_token);
}

}  // namespace corbot::panel
