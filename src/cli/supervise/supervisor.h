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

/// Starts processes one after the other, each when the previous one is ready. Restarts processes that die or
/// no longer respond, and ends all of them in the opposite order. Serves each process like systemd serves a
/// service of Type=notify. It handles READY=1, WATCHDOG=1, STATUS=, FDSTORE=1 and FDSTOREREMOVE=1 of
/// sd_notify(3). The next start gets the stored descriptors as in sd_listen_fds(3). Uses one thread. It owns
/// the signals SIGINT, SIGTERM, SIGCHLD and, unless ignored, SIGHUP.
class Supervisor {
 public:
  struct Spec {
    std::string title;
    std::vector<std::string> command;
    std::vector<std::string> restart_command{};  ///< if it differs
    /// Returns true when the process can be used. Called once for each line that it prints, and about ten
    /// times a second with an empty line. None: the process reports READY=1.
    std::function<bool(const std::string& line)> is_ready{};
    double ready_within_s{10};
    /// Longest interval of WATCHDOG=1 after readiness, or the process is killed and replaced. 0: no watchdog.
    double respond_s{0};
    /// of its log; they end the message when the supervisor gives it up
    std::function<std::string()> last_lines{};
    std::string examine_with{};  ///< command that examines why it ended at its start; empty: none
    double end_within_s{5};      ///< after SIGTERM; then SIGKILL
    /// Appended to the command if the previous process had been ready, did not respond and was killed.
    std::vector<std::string> after_unresponsive{};
    /// False: the others work without it. Once it has been ready, it is never given up, and all_ready() does
    /// not count it.
    bool is_needed{true};
  };
  struct Options {
    std::string notify_path;  ///< of the socket
    /// manager of this process, which also keeps the stored descriptors; null: none
    ServiceManager* manager{nullptr};
    bool restarts{true};  ///< false: a needed process that dies stays ended, and on_change is called
    int attempts{10};     ///< consecutive starts that fail before it gives up; 0: endless
    std::function<void()> on_change;  ///< called after every start and restart; throws nothing
    bool until_eof{false};            ///< the end of standard input requests the end, like a signal
    std::function<int()> input_fd{};  ///< on_step is called at once if it has input; −1: none
    std::function<void()> on_step{};  ///< called about ten times a second; throws nothing
    /// Called about ten times a second while processes are being ended, first before any of them is; throws
    /// nothing.
    std::function<void()> on_ending{};
  };

  explicit Supervisor(Options options);
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;
  ~Supervisor();

  /// Starts the next process and waits until it is ready. Returns false if a signal requested the end
  /// meanwhile. Throws Failure if the process does not become ready.
  [[nodiscard]] bool start(Spec spec);
  /// Waits briefly, then handles pending events. Returns false when a signal has requested the end. Throws
  /// Failure when it gives up a process.
  [[nodiscard]] bool step();
  /// Ends the process that was started last: SIGTERM, then SIGKILL after its time or at a second Ctrl-C.
  void stop_last();
  /// Ends all processes in the same way, the last started first.
  void stop_all();

  [[nodiscard]] pid_t pid_of(const std::string& title) const;
  /// Returns true if every process that is needed is ready and responds.
  [[nodiscard]] bool all_ready() const;
  /// Returns the signal that requested the end, SIGHUP for the end of standard input; 0: none yet.
  [[nodiscard]] int end_signal() const noexcept { return end_signal_; }

 private:
  using Clock = Child::Clock;
  struct Entry {
    Spec spec;
    Child child;
    bool ready{false};
    bool was_killed{false};  ///< by this supervisor, because it did not respond
    bool was_frozen{false};  ///< killed because it did not respond after it had been ready
    bool restarted{false};   ///< at least once
    int failed_attempts{0};  ///< consecutive starts that did not become ready
    BackOff back_off{};
    Clock::time_point restart_at{};
    Clock::time_point responded{};  ///< last WATCHDOG=1, or the time at which it became ready
    std::string status{};           ///< last STATUS=
    DescriptorStore stored{};
  };

  /// Waits for signals, output and messages, at most `seconds`.
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
  /// `interrupts_before`: interrupts_ when the end began.
  void stop_last(int interrupts_before);
  void restore_socket();

  Options options_;
  NotifySocket notify_;
  std::list<Entry> entries_;
  int signal_fd_{-1};
  int end_signal_{0};
  int interrupts_{0};  ///< SIGINTs received; another SIGTERM or SIGHUP joins the end that is under way
  Clock::time_point last_step_{};
  bool socket_lost_{false};  ///< no message can be received
};

}  // namespace corbot::cli
