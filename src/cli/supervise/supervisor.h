// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <list>
#include <string>
#include <vector>

#include "cli/supervise/child.h"

namespace corbot::cli {

/// Starts processes one after the other, each when the one before is ready, restarts what dies, and ends all
/// of them in the opposite order. One thread; the signals SIGINT, SIGTERM, SIGHUP and SIGCHLD belong to it.
class Supervisor {
 public:
  struct Spec {
    std::string title;
    std::vector<std::string> command;
    /// True once the process can be used. Called for each line that it prints, and with an empty line about
    /// ten times a second; a line is passed once.
    std::function<bool(const std::string& line)> is_ready;
    double ready_within_s{10};
  };

  /// `on_change` is called after every start and restart.
  explicit Supervisor(std::function<void()> on_change);
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;
  ~Supervisor();

  /// Starts the next process and waits until it is ready. False when a signal requested the end meanwhile.
  /// Throws Failure when it does not become ready.
  [[nodiscard]] bool start(Spec spec);
  /// Restarts what dies, until a signal requests the end.
  void run();
  /// Ends all, last started first: SIGTERM, SIGKILL after five seconds or at a second signal.
  void stop_all();

  [[nodiscard]] pid_t pid_of(const std::string& title) const;

 private:
  using Clock = Child::Clock;
  struct Entry {
    Spec spec;
    Child child;
    bool ready{false};
    double back_off_s{0};
    Clock::time_point restart_at{};
  };

  /// Waits for signals and output, at most that long. Counts end_requests_.
  void poll(double seconds);
  void read_signals();
  void read_output(Entry& entry);
  void supervise(Entry& entry);
  void schedule_restart(Entry& entry, int status);

  std::function<void()> on_change_;
  std::list<Entry> entries_;
  int signal_fd_{-1};
  int end_requests_{0};  ///< signals received
};

}  // namespace corbot::cli
