// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace corbot::test {

/// A network of its own between clients and a server on the loopback interface: a relay that can keep replies
/// back, cut every connection, or let it fall silent.
class CutProxy {
 public:
  /// Relays connections to its own port to `server_port`. Throws std::runtime_error when it cannot listen.
  explicit CutProxy(int server_port);
  CutProxy(const CutProxy&) = delete;
  CutProxy& operator=(const CutProxy&) = delete;
  ~CutProxy();

  [[nodiscard]] int port() const { return port_; }
  /// How many requests for that operation clients have sent through this so far.
  [[nodiscard]] int requests(const std::string& operation);
  /// From now on nothing that the server sends reaches a client.
  void hold_replies() { holds_ = true; }
  /// Ends every connection at both sides, and relays anew what is opened from now on.
  void cut();
  /// Every present connection falls silent towards the server, see silence.h.
  void fall_silent();

 private:
  struct Line {
    int client;
    int server;
    bool is_silent{false};
    std::string sent{};  ///< by the client
  };
  void run();
  void take();
  /// False when either side has ended.
  bool relay(Line& line, int from);
  void end(Line& line);

  int server_port_;
  int listening_ = -1;
  int wake_ = -1;
  int port_ = 0;
  std::atomic<bool> end_{false};
  std::atomic<bool> holds_{false};
  std::mutex mutex_;  ///< of the lines, held while they are relayed
  std::vector<Line> lines_;
  std::string sent_before_;  ///< on lines that have ended
  std::thread thread_;
};

}  // namespace corbot::test
