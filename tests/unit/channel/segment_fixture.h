// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "shm/segment.h"

namespace corbot {

inline constexpr std::uint64_t kTestFingerprint = 0x1234;

/// A segment name of the test's own, so that tests run in parallel,
/// and nothing left in /dev/shm, whatever happened.
class SegmentTest : public testing::Test {
 protected:
  SegmentTest() : name_("t" + std::to_string(::getpid()) + "-" + std::to_string(counter_++)) {}
  ~SegmentTest() override { std::filesystem::remove(path()); }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::string path() const { return "/dev/shm/corbot." + name_; }
  [[nodiscard]] bool exists() const { return std::filesystem::exists(path()); }

  [[nodiscard]] Segment task() const { return Segment::create_or_adopt(name_, kTestFingerprint); }
  [[nodiscard]] Segment servant() const { return Segment::attach(name_, kTestFingerprint); }

 private:
  inline static std::atomic<int> counter_{0};
  std::string name_;
};

/// A process that runs `body`, says so, and then waits to be killed. _exit: nothing of the test runs twice.
class Child {
 public:
  explicit Child(const std::function<void()>& body) {
    int ready[2];
    if (::pipe(ready) != 0) ::abort();
    pid_ = ::fork();
    if (pid_ == 0) {
      try {
        body();
      } catch (...) {
        ::_exit(1);
      }
      (void)!::write(ready[1], "r", 1);
      for (;;) ::pause();
    }
    ::close(ready[1]);
    char byte = 0;
    ready_ = ::read(ready[0], &byte, 1) == 1;  // end of file when it failed
    ::close(ready[0]);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { kill(); }

  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// kill -9, and wait until the kernel has taken it away: its locks are free afterwards.
  void kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_{0};
  bool ready_{false};
};

/// The error that `action` ends in; none when it succeeds.
inline std::optional<SegmentError> error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const SegmentError& error) {
    return error;
  }
  return std::nullopt;
}

}  // namespace corbot
