// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace corbot::test {

using Deadline = std::chrono::steady_clock::time_point;

/// `seconds` from now. Generous values: tests wait for conditions, a deadline only ends a hang.
inline Deadline within(double seconds) {
  return std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                std::chrono::duration<double>(seconds));
}

/// Polls `condition` until it holds or the deadline has passed. A condition can start a program or call a
/// servant. The pause is four times as long as the condition took, so that polling leaves the processor to
/// the other tests. It is 1 to 200 ms.
template <class Condition>
bool wait_until(Deadline deadline, Condition&& condition) {
  using Clock = Deadline::clock;
  for (Clock::time_point begun = Clock::now(); !condition(); begun = Clock::now()) {
    const Clock::time_point now = Clock::now();
    if (now > deadline) return false;
    std::this_thread::sleep_for(std::clamp<Clock::duration>(4 * (now - begun), std::chrono::milliseconds(1),
                                                            std::chrono::milliseconds(200)));
  }
  return true;
}

/// A child process: its standard output can be read line by line, its input written to, it
/// dies with the test, and the destructor leaves no process behind. Standard error is
/// collected too (both go to one pipe each).
class Process {
 public:
  /// Starts `command`; throws std::runtime_error when that fails. `environment`: NAME=value, in place of
  /// the test's own or added to it, as is a state directory for all children of one test program.
  explicit Process(std::vector<std::string> command, const std::vector<std::string>& environment = {});
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] bool running();
  /// Returns the resident memory now without pages of files, in kilobytes; −1 when the process has ended.
  [[nodiscard]] long anonymous_kb() const;

  /// The first line from now on that begins with `prefix`; nothing when the output
  /// ends or the deadline passes first.
  std::optional<std::string> wait_line(const std::string& prefix, Deadline deadline);
  /// Writes a line to its standard input.
  void send(const std::string& line);
  /// Sends a signal; no effect on a child that has been waited for. Returns from SIGSTOP when each of its
  /// threads has stopped.
  void signal(int number) const;
  /// Ends its standard input.
  void close_input();
  /// Closes the reading end of its standard error.
  void close_errors();
  /// Waits for the end and returns the status as of waitpid(2); nothing when the deadline passes first.
  std::optional<int> wait(Deadline deadline);
  /// SIGTERM, then the exit code (128 + signal for a killed one); −1 when the child
  /// does not end within ten seconds.
  int terminate();
  /// Everything that was read of standard output and standard error so far.
  [[nodiscard]] const std::string& output();
  [[nodiscard]] const std::string& errors();

 private:
  void drain();

  pid_t pid_ = -1;
  int in_ = -1;
  int out_ = -1;
  int err_ = -1;
  std::optional<int> status_;
  std::string out_text_;
  std::string err_text_;
  std::size_t line_begin_ = 0;
};

/// The exit code of a whole run, and what it printed.
struct RunResult {
  int code;
  std::string output;
  std::string errors;
};
RunResult run(std::vector<std::string> command, double seconds = 60.0,
              const std::vector<std::string>& environment = {});

/// Whether the servant of these tests is the one on ORBit2 (CORBOT_TEST_ORB=orbit2),
/// and its program in `directory`.
bool on_orbit2();
std::string servant_program(const std::string& directory);

/// A robot name that no other test of this machine uses.
std::string unique_name(const std::string& stem);

/// Returns the path on which a real-time task listens. `runtime`: the XDG_RUNTIME_DIR that it was started
/// with, if not the test's.
std::string channel_path(const std::string& robot, const std::string& runtime = "");
/// Whether that is there: a task runs, was killed, or has left it to a servant.
bool channel_exists(const std::string& robot, const std::string& runtime = "");

}  // namespace corbot::test
