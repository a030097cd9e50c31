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

/// Path of a program of this project: beside the running executable, else the bare name for PATH.
[[nodiscard]] std::string beside_executable(const std::string& program);

/// Path of a program beside the running executable or in PATH; nothing when there is none.
[[nodiscard]] std::optional<std::string> find_program(const std::string& program);

/// "signal 9 (Killed)" or "exit code 1", of a wait status.
[[nodiscard]] std::string describe_end(int wait_status);

/// What a child finds in its environment, as systemd would put it there.
struct Service {
  std::string notify_socket{};             ///< NOTIFY_SOCKET; empty: none
  double watchdog_s{0};                    ///< WATCHDOG_USEC; 0: none
  const DescriptorStore* stored{nullptr};  ///< LISTEN_FDS, LISTEN_FDNAMES; null: none
  bool errors_too{false};                  ///< its standard error is read like its output
};

/// One process under the supervisor. It has a process group of its own, so that Ctrl-C on the terminal
/// reaches the supervisor only, which ends the children in order; the kernel sends it SIGTERM when the
/// supervisor dies.
class Child {
 public:
  using Clock = std::chrono::steady_clock;

  /// `title` names it in messages.
  Child(std::string title, std::vector<std::string> command);
  Child(Child&& other) noexcept;
  Child& operator=(Child&&) = delete;
  ~Child();  ///< kills what still runs

  /// Must be called from the supervisor's main thread: the kernel ties the death signal
  /// to the thread. `more` is added to the command. Throws Failure.
  void start(const Service& service = {}, const std::vector<std::string>& more = {});
  /// Reads what it printed; empties and returns the whole lines. Its end of file closes output_fd().
  [[nodiscard]] std::vector<std::string> read_lines();
  /// Whether it has ended. Until reap() its pid is no other process's.
  [[nodiscard]] bool has_ended() const;
  /// Its wait status once it has ended; reaps it.
  [[nodiscard]] std::optional<int> reap();
  /// Waits for its end; its wait status.
  [[nodiscard]] int wait();
  void send(int signal) const;
  /// For the next start.
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
