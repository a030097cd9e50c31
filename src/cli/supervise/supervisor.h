// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <list>
#include <string>
#include <vector>

#include "cli/supervise/back_off.h"
#include "cli/supervise/child.h"
#include "cli/supervise/notify_socket.h"
#include "cli/supervise/service_manager.h"
#include "client/failure.h"

namespace corbot::cli {

/// Starts processes one after the other, each when the one before is ready, restarts what dies or no longer
/// responds, and ends all of them in the opposite order. To each it is what systemd is to a service of
/// Type=notify: READY=1, WATCHDOG=1, STATUS=, FDSTORE=1 and FDSTOREREMOVE=1 of sd_notify(3), and the stored
/// descriptors at the next start as of sd_listen_fds(3). One thread; the signals SIGINT, SIGTERM, SIGCHLD
/// and, unless it is ignored, SIGHUP belong to it.
class Supervisor {
 public:
  struct Spec {
    std::string title;
    std::vector<std::string> command;
    std::vector<std::string> restart_command{};  ///< where it differs
    /// True once the process can be used. Called for each line that it prints, and with an empty line about
    /// ten times a second; a line is passed once. None: the process reports READY=1.
    std::function<bool(const std::string& line)> is_ready{};
    double ready_within_s{10};
    /// Once ready, WATCHDOG=1 comes at least this often, or the process is killed and replaced. 0: unwatched.
    double respond_s{0};
    std::function<std::string()> last_lines{};  ///< of its log; the message that gives it up ends with them
    std::string examine_with{};  ///< the command that examines why it ended at its start; empty: none
    double end_within_s{5};      ///< after SIGTERM; then SIGKILL
    /// Added to the command when the process before had been ready, did not respond and was killed.
    std::vector<std::string> after_unresponsive{};
  };
  struct Options {
    std::string notify_path;           ///< of the socket
    ServiceManager* manager{nullptr};  ///< of this process: keeps the stored descriptors, too; null: none
    bool restarts{true};               ///< false: what dies stays ended, and on_change is called
    int attempts{10};  ///< starts in a row that do not get ready before it gives up; 0: endless
    std::function<void()> on_change;  ///< called after every start and restart; throws nothing
    bool until_eof{false};            ///< the end of standard input requests the end, as a signal does
    std::function<int()> input_fd{};  ///< with input there, on_step is called at once; −1: none
    std::function<void()> on_step{};  ///< called about ten times a second; throws nothing
  };

  explicit Supervisor(Options options);
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;
  ~Supervisor();

  /// Starts the next process and waits until it is ready. False when a signal requested the end meanwhile.
  /// Throws Failure when it does not become ready.
  [[nodiscard]] bool start(Spec spec);
  /// Waits a moment at most, then handles what has happened. False once a signal has requested the end. Throws
  /// Failure when it gives a process up.
  [[nodiscard]] bool step();
  /// Ends the process that was started last: SIGTERM, then SIGKILL after its time or at a second signal.
  void stop_last();
  /// Ends all, last started first, each in the same way.
  void stop_all();

  [[nodiscard]] pid_t pid_of(const std::string& title) const;
  /// Whether every process is ready and responds.
  [[nodiscard]] bool all_ready() const;
  /// The signal that requested the end, SIGHUP for the end of standard input; 0: none yet.
  [[nodiscard]] int end_signal() const noexcept { return end_signal_; }

 private:
  using Clock = Child::Clock;
  struct Entry {
    Spec spec;
    Child child;
    bool ready{false};
    bool was_killed{false};  ///< by this supervisor, because it did not respond
    bool was_frozen{false};  ///< the same, after it had been ready
    bool restarted{false};   ///< at least once
    int failed_attempts{0};  ///< starts in a row that did not get ready
    BackOff back_off{};
    Clock::time_point restart_at{};
    Clock::time_point responded{};  ///< last WATCHDOG=1, or when it got ready
    std::string status{};           ///< last STATUS=
    DescriptorStore stored{};
  };

  /// Waits for signals, output and messages, at most that long. Counts end_requests_.
  void poll(double seconds);
  void read_signals();
  void read_standard_input();
  void request_end(int signal);
  void read_notifications();
  void store(Entry& entry, const std::string& name, Descriptor fd);
  void apply(Entry& entry, Notification& notification);
  void read_output(Entry& entry);
  void set_ready(Entry& entry);
  void supervise(Entry& entry);
  void kill_unresponsive(Entry& entry);
  void start_child(Entry& entry);
  void schedule_restart(Entry& entry, const std::string& why);
  [[noreturn]] static void give_up(const Entry& entry, client::ExitCode code, const std::string& why);
  void allow_for_own_gap();
  /// `requests_before`: signals received when the end began.
  void stop_last(int requests_before);
  void restore_socket();

  Options options_;
  NotifySocket notify_;
  std::list<Entry> entries_;
  int signal_fd_{-1};
  int end_requests_{0};  ///< signals received, and the end of standard input
  int end_signal_{0};
  Clock::time_point last_step_{};
  bool socket_lost_{false};  ///< nothing can be heard
};

}  // namespace corbot::cli
