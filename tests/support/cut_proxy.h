// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace corbot::test {

/// The point in a call at which its connection is cut.
struct CutPoint {
  enum class Part { kRequest, kReply };
  std::string operation;
  Part part{};
  double share{};  ///< of that message's bytes are passed on before, 0 to 1
  bool resets{};   ///< by RST towards both sides; else by FIN
};

/// A network of its own between clients and a server on the loopback interface: a relay that can keep replies
/// back, cut connections, or let them fall silent. It looks at what the server answers.
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
  /// Cuts the connection of the next such call there, once. Other connections go on.
  void cut_at(CutPoint point);
  /// Whether that has been done.
  [[nodiscard]] bool is_cut() const { return is_cut_; }
  /// Count what the server has sent so far: Replies, and the messages that forward a client to another
  /// reference.
  [[nodiscard]] int replies() const { return replies_; }
  [[nodiscard]] int forwards() const { return forwards_; }

 private:
  struct Line {
    int client;
    int server;
    bool is_silent{false};
    std::string sent{};  ///< by the client
    bool resets{false};  ///< at its end
    bool is_reply_to_be_cut{false};
    std::string requests{};  ///< not passed on yet
    std::string replies{};
  };
  void run();
  void take();
  /// These are false when either side has ended, or the line is cut.
  bool relay(Line& line, int from);
  bool pass_requests(Line& line);
  bool pass_replies(Line& line);
  /// Passes on a part of `message` only.
  bool cut_in(Line& line, int to, const std::string& message);
  void end(Line& line);

  int server_port_;
  int listening_ = -1;
  int wake_ = -1;
  int port_ = 0;
  std::atomic<bool> end_{false};
  std::atomic<bool> holds_{false};
  std::atomic<bool> is_cut_{false};
  std::atomic<int> replies_{0};
  std::atomic<int> forwards_{0};
  std::mutex mutex_;  ///< of the lines, held while they are relayed, and of the point
  std::vector<Line> lines_;
  std::optional<CutPoint> point_;
  std::string sent_before_;  ///< on lines that have ended
  std::thread thread_;
};

}  // namespace corbot::test
