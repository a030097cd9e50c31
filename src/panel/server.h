// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "panel/robot_watch.h"
#include "panel/server_settings.h"

namespace corbot::panel {

/// Serves the page, and to it the newest states of robots:
///   GET /, /…          the files of the page
///   GET /api/robots    what connect() of each robot returned
///   POST /api/stop     stops all robots, or the one that the body {"robot": NAME} names; the reply says which are at rest
///   GET /ws            a WebSocket: each robot's newest state, 50 a second at the most, and {"stop": {}}, as the body above
/// All but the files need the token: `Authorization: Bearer TOKEN`, or `?token=TOKEN`. One thread does everything, and waits
/// neither for a robot nor for a browser. For each robot a WebSocket holds one text that is being sent; the next one is the newest then.
class Server {
 public:
  /// Listens, and starts to watch. Throws client::Failure.
  Server(ServerSettings settings, std::vector<std::unique_ptr<RobotWatch>> robots);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// run() has returned. Waits for calls to robots that are under way.
  ~Server();

  [[nodiscard]] int port() const;
  /// Serves until end().
  void run();
  /// From any thread.
  void end();

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace corbot::panel
