// SPDX-License-Identifier: Apache-2.0
#include "panel/server.h"

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

#include "client/failure.h"
#include "client/local_robots.h"
#include "panel/http_session.h"
#include "panel/hub.h"

namespace corbot::panel {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using client::ExitCode;
using client::Failure;

/// The buffer is small, because its data are old when a slow browser reads them.
constexpr int kSendBufferBytes = 16'384;
constexpr std::chrono::milliseconds kAfterFailedAccept{100};

tcp::acceptor listen(asio::io_context& io, const std::string& host, int port) {
  error_code error;
  const auto address = asio::ip::make_address(host, error);
  if (error) throw Failure(ExitCode::kUsage, host + ": write the address to listen on in figures");
  try {
    tcp::acceptor acceptor(io, {address, static_cast<unsigned short>(port)});
    acceptor.set_option(
        asio::socket_base::send_buffer_size(kSendBufferBytes));  // each connection inherits it
    return acceptor;
  } catch (const boost::system::system_error& e) {
    const std::string why = client::endpoint_fault(host, port);
    throw Failure(ExitCode::kInternal,
                  why.empty() ? e.code().message() : why + ": choose another --port or --host");
  }
}

}  // namespace

class Server::Listener {
 public:
  Listener(ServerSettings settings, std::vector<std::unique_ptr<Watch>> watches)
      : hub_(std::move(settings), std::move(watches)),
        acceptor_(listen(hub_.io, hub_.settings.host, hub_.settings.port)),
        pause_(hub_.io) {
    accept();
    for (const auto& watch : hub_.watches) watch->start([this] { on_change(); }, hub_.received_stops);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() = default;

  [[nodiscard]] int port() const { return acceptor_.local_endpoint().port(); }
  void run() { hub_.io.run(); }
  void end() { hub_.io.stop(); }

 private:
  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (!error) {
        take(std::move(socket));
        return accept();
      }
      // For example, no file descriptor was left. The server tries again after a pause.
      pause_.expires_after(kAfterFailedAccept);
      pause_.async_wait([this](error_code) { accept(); });
    });
  }

  void take(tcp::socket socket) {
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto session = std::make_shared<HttpSession>(hub_, std::move(socket));
    hub_.add_request(session);
    session->start();
  }

  /// The threads of the robots call it. It posts nothing while the previous call is still queued.
  void on_change() {
    if (is_posted_.exchange(true)) return;
    asio::post(hub_.io, [this] {
      is_posted_ = false;
      hub_.on_change();
    });
  }

  std::atomic<bool> is_posted_{false};
  Hub hub_;
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
};

Server::Server(ServerSettings settings, std::vector<std::unique_ptr<Watch>> watches)
    : listener_(std::make_unique<Listener>(std::move(settings), std::move(watches))) {}
Server::~Server() = default;
int Server::port() const { return listener_->port(); }
void Server::run() { listener_->run(); }
void Server::end() { listener_->end(); }

}  // namespace corbot::panel
