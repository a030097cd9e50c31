// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

namespace corbot::soak {

/// Passes TCP connections on to a port of this host, and breaks them on request.
class Proxy {
 public:
  /// Listens on loopback:`port`. Throws std::runtime_error.
  Proxy(int port, int target_port);
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;
  ~Proxy();

  /// Every connection is reset.
  void cut();
  /// While on, nothing passes in either direction, and no end is reported: half-open connections.
  void swallow(bool on) { swallow_ = on; }

 private:
  struct Pair {
    int client;
    int server;
  };
  void run();
  void accept_one();
  /// False when one of the two has ended.
  static bool pass(int from, int to);
  static void reset(const Pair& pair);

  int target_port_;
  int listener_;
  std::atomic<bool> end_{false};
  std::atomic<bool> swallow_{false};
  std::mutex mutex_;  // of pairs_
  std::vector<Pair> pairs_;
  std::thread thread_;
};

}  // namespace corbot::soak
