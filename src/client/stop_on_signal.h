// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace corbot::client {

/// Calls `action` in a thread of its own on the first signal, instead of ending the program. The signals are
/// SIGINT, SIGTERM and SIGHUP; SIGHUP stays ignored under nohup. The second signal ends the program at once
/// with exit code 4. Must be constructed before any other thread, so that all of them inherit the blocked
/// signals.
class OnSignal {
 public:
  explicit OnSignal(std::function<void()> action);
  OnSignal(const OnSignal&) = delete;
  OnSignal& operator=(const OnSignal&) = delete;
  ~OnSignal();

  [[nodiscard]] bool seen() const noexcept { return seen_.load(); }

  /// Names the received signal: "Ctrl-C" for SIGINT.
  [[nodiscard]] std::string describe() const;

  /// Waits until the action has returned. To be called only after a signal.
  void join() const;

  /// Waits for a signal or the time-out; returns true if a signal was received.
  bool wait(double seconds) const;

 private:
  void run();
  std::function<void()> action_;
  std::atomic<bool> seen_{false};
  std::atomic<bool> acted_{false};
  std::atomic<int> signal_{0};  ///< the first one
  int end_fd_{-1};              ///< eventfd: ends the thread
  int seen_fd_{-1};             ///< eventfd: readable after a signal
  std::thread thread_;
};

}  // namespace corbot::client
