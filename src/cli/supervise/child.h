// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/supervise/descriptor_store.h"

namespace corbot::cli {

/// Returns the path of a program of this project: beside the running executable, else the bare name for PATH.
[[nodiscard]] std::string beside_executable(const std::string& program);

/// Returns the path of a program beside the running executable or in PATH, or nothing if there is none.
[[nodiscard]] std::optional<std::string> find_program(const std::string& program);

/// Describes a wait status: "signal 9 (Killed)" or "exit code 1".
[[nodiscard]] std::string describe_end(int wait_status);

/// Variables in a child's environment, like those that systemd sets.
struct Service {
  std::string notify_socket{};             ///< NOTIFY_SOCKET; empty: none
  double watchdog_s{0};                    ///< WATCHDOG_USEC; 0: none
  const DescriptorStore* stored{nullptr};  ///< LISTEN_FDS, LISTEN_FDNAMES; null: none
  bool errors_too{false};                  ///< its standard error is read like its output
};

/// One process under the supervisor. It has its own process group, so Ctrl-C on the terminal reaches only the
/// supervisor, which ends the children in order. The kernel sends SIGTERM to the process when the supervisor
/// dies.
class Child {
 public:
  using Clock = std::chrono::steady_clock;

  /// `title` is the name in messages.
  Child(std::string title, std::vector<std::string> command);
  Child(Child&& other) noexcept;
  Child& operator=(Child&&) = delete;
  ~Child();  ///< kills the process if it still runs

  /// Starts the process. Only the supervisor's main thread may call it: the kernel ties the death signal to
  /// the thread. `more` is appended to the command. Throws Failure.
  void start(const Service& service = {}, const std::vector<std::string>& more = {});
  /// Reads the output of the process; returns and removes the whole lines. Closes output_fd() at the end of
  /// file.
  [[nodiscard]] std::vector<std::string> read_lines();
  /// Returns true if the process has ended. No other process gets its pid before reap().
  [[nodiscard]] bool has_ended() const;
  /// Reaps the process if it has ended, and returns its wait status.
  [[nodiscard]] std::optional<int> reap();
  /// Waits for the end of the process and returns its wait status.
  [[nodiscard]] int wait();
  void send(int signal) const;
  /// Sets the command of the next start.
  void set_command(std::vector<std::string> command) { command_ = std::move(command); }

  [[nodiscard]] const std::string& title() const noexcept { return title_; }
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }  ///< 0 = not running
  [[nodiscard]] int output_fd() const noexcept { return output_fd_; }
  [[nodiscard]] Clock::time_point started() const noexcept { return started_; }

 private:
  void close_output();
  std::string title_;
  std::vector<std::string> command_;
  pid_t pid_{0};
  int output_fd_{-1};
  std::string partial_;
  Clock::time_point started_{};
};

}  // namespace corbot::cli
