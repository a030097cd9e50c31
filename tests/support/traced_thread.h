// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace corbot::test {

/// A thread is about to make this system call.
struct SystemCall {
  std::uint64_t number{};
  std::array<std::uint64_t, 6> arguments{};
};

/// One thread of a child process, held by ptrace(2) while its other threads run on: a thread that hangs. To
/// be used from one thread of the test. The destructor lets it go on from where it is.
class TracedThread {
 public:
  /// Holds the thread. Throws std::runtime_error where the machine does not allow that; see is_allowed().
  TracedThread(pid_t process, pid_t thread);
  TracedThread(TracedThread&& other) noexcept;
  TracedThread& operator=(TracedThread&&) = delete;
  ~TracedThread() { release(); }

  /// Lets it go on from where it is.
  void release() noexcept;
  /// Lets it go on as one that computes without end: in a jump to itself. Not to be undone; the process is to
  /// be killed. False where this is not known for the processor.
  [[nodiscard]] bool spin();

  /// Lets it run to its next system call and through it. Returns the call's number; nothing when the thread
  /// has ended.
  [[nodiscard]] std::optional<std::uint64_t> run_to_system_call();
  /// This lets it go on until its next system call, without waiting for that, and is false when it has ended.
  [[nodiscard]] bool go_on();
  /// After go_on() this is the system call that it is about to make, or nothing while it runs or sleeps.
  [[nodiscard]] std::optional<SystemCall> look();
  /// After go_on() this holds it wherever it is.
  void interrupt() noexcept;
  /// Returns the address of the next instruction.
  [[nodiscard]] std::uint64_t instruction_pointer() const;
  /// One instruction. False when the thread has ended.
  [[nodiscard]] bool step();

 private:
  [[nodiscard]] bool resume(int request);
  pid_t process_;
  pid_t thread_;  // 0: not held
};

/// "": a test may hold threads of its children; else why not, for GTEST_SKIP.
[[nodiscard]] std::string why_not_traceable();

/// This holds one of these threads where it is about to make a system call that is wanted, and the others go
/// on. It is nothing when none makes such a call by then.
[[nodiscard]] std::optional<TracedThread> hold_at_call(
    pid_t process, const std::vector<pid_t>& threads, const std::function<bool(const SystemCall&)>& is_wanted,
    std::chrono::steady_clock::time_point deadline);

/// Ids of the threads of a process, the first one first.
[[nodiscard]] std::vector<pid_t> threads_of(pid_t process);
/// As in /proc/PID/task/TID/comm.
[[nodiscard]] std::string thread_name(pid_t process, pid_t thread);

}  // namespace corbot::test
