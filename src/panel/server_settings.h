// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace corbot::panel {

struct ServerSettings {
  std::string host{"127.0.0.1"};          ///< the address to listen on, in figures
  int port{0};                            ///< 0: any that is free
  std::vector<std::string> more_hosts{};  ///< names besides those of the loopback by which browsers may come
  std::filesystem::path pages;            ///< directory of the page
  /// Who has it may watch and stop. It has only characters that a URL takes as they are.
  std::string watch_token;
  /// Connections without a WebSocket: the one that is idle for longest makes room for a new one.
  std::size_t most_requests{32};
  std::size_t most_sockets{32};  ///< more are refused
  /// After this time a connection without a whole request is closed, and a WebSocket that answers no ping.
  std::chrono::milliseconds idle{10'000};
  std::chrono::milliseconds socket_idle{20'000};
};

}  // namespace corbot::panel
