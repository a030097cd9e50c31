// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "panel/server_settings.h"
#include "panel/watch.h"

namespace corbot::panel {

/// Serves the page and the newest states of robots:
///   GET /, /…          the files of the page.
///   GET /api/robots    the result of connect() for each robot.
///   GET /api/cells     the same for each cell.
///   GET /api/cells/NAME/picture   the newest picture of the cell's camera, a JPEG file.
///   GET /api/rights    {"drive": true} if the token allows to move robots.
///   POST /api/stop     stops all robots and cells, or only the one that the body {"robot": NAME} or
///                      {"cell": NAME} names. The reply has the result for each.
///   POST /api/call     makes a robot do something: {"robot": NAME, "do": "move", "to_m": [X, Y, Z]}.
///                      It needs the token to drive. Status 200: the robot has accepted it.
///                      {"done": true, "ticket": N} is the reply to a motion, which goes on.
///                      Status 409: the robot refuses; {"text": REASON}. Status 400: the body is wrong.
///   POST /api/program  runs a program on a robot: {"robot": NAME, "name": FILE, "text": PROGRAM}. It needs
///                      the token to drive, and does not wait: the robot's states have the key "program".
///   GET /ws            a WebSocket. It sends each robot's and cell's newest state, at most 50 a second.
///                      It accepts {"stop": {}}, whose object is like the body above.
///
/// All requests except for files need the token: `Authorization: Bearer TOKEN`, or `?token=TOKEN`. One thread
/// serves all connections, and waits neither for a robot nor for a browser. A WebSocket queues no states: it
/// sends one text at a time, and then the newest state.
class Server {
 public:
  /// Listens, and starts all watches. Throws client::Failure.
  Server(ServerSettings settings, std::vector<std::unique_ptr<Watch>> watches);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Waits for calls to robots that are in progress. run() must have returned before.
  ~Server();

  [[nodiscard]] int port() const;
  /// Serves until a call of end().
  void run();
  /// Makes run() return. Any thread may call it.
  void end();

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace corbot::panel
