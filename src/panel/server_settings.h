// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace corbot::panel {

struct ServerSettings {
  std::string host{"127.0.0.1"};          ///< numeric address to listen on
  int port{0};                            ///< 0: any free port
  std::vector<std::string> more_hosts{};  ///< host names that requests may use, besides the loopback's
  std::filesystem::path pages;            ///< directory of the page
  /// A client with this token may watch and stop. Its characters need no escape in a URL.
  std::string watch_token;
  std::string drive_token{};  ///< a client with this token may also move robots; empty: no client may
  /// Limit of connections without a WebSocket. Beyond it, a new one replaces the one that is idle for
  /// longest.
  std::size_t most_requests{32};
  std::size_t most_sockets{32};  ///< the server refuses more
  /// The server closes a connection that sends no whole request within this time.
  std::chrono::milliseconds idle{10'000};
  /// The server closes a WebSocket that answers no ping within this time.
  std::chrono::milliseconds socket_idle{20'000};
};

}  // namespace corbot::panel
