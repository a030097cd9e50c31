// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace corbot::client {

/// During its lifetime, the first SIGINT, SIGTERM or, unless it is ignored as under nohup, SIGHUP calls
/// `action` in a thread of its own instead of ending the program; the second one ends it at once with exit
/// code 4. To be constructed before any other thread, so that all of them inherit the blocked signals.
class OnSignal {
 public:
  explicit OnSignal(std::function<void()> action);
  OnSignal(const OnSignal&) = delete;
  OnSignal& operator=(const OnSignal&) = delete;
  ~OnSignal();

  [[nodiscard]] bool seen() const noexcept { return seen_.load(); }

  /// Names the signal that was seen: "Ctrl-C" for SIGINT.
  [[nodiscard]] std::string describe() const;

  /// Waits until the action has returned. Only where a signal was seen.
  void join() const;

  /// Waits until a signal has been seen or the time has passed; true when it was seen.
  bool wait(double seconds) const;

 private:
  void run();
  std::function<void()> action_;
  std::atomic<bool> seen_{false};
  std::atomic<bool> acted_{false};
  std::atomic<int> signal_{0};  ///< the first one
  int end_fd_{-1};              ///< eventfd: ends the thread
  int seen_fd_{-1};             ///< eventfd: readable once a signal was seen
  std::thread thread_;
};

}  // namespace corbot::client
