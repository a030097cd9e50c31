// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "shm/channel_client.h"
#include "shm/channel_server.h"

namespace corbot {

inline constexpr std::uint64_t kTestFingerprint = 0x1234;

/// Holds a real-time task's part of the channel; the test plays its cycle.
struct TaskEnd {
  TaskEnd(const std::string& robot, ChannelPolicy policy)
      : task(Segment<TaskSegment>::create(robot, kTestFingerprint)),
        stop(Segment<StopSegment>::create(robot, kTestFingerprint)),
        server(robot, kTestFingerprint, policy) {}
  void serve() {
    server.serve(task, stop, mailbox, [this](const Descriptor&) { ++kept; });
  }
  /// Takes the new servant as the cycle does at the beginning of a step; null when there is none.
  const ServantOffer* step() {
    const ServantOffer* const servant = mailbox.take();
    if (servant == nullptr) return nullptr;
    mailbox.confirm(servant->session);
    Snapshot snapshot{};
    (void)task->snapshot.load(snapshot);
    snapshot.servant_session = servant->session;
    task->snapshot.store(snapshot);
    return servant;
  }
  const ServantOffer* await_servant() {
    for (;;) {
      if (const ServantOffer* const servant = step()) return servant;
      ::sched_yield();
    }
  }

  Segment<TaskSegment> task;
  Segment<StopSegment> stop;
  ServantMailbox mailbox;
  std::atomic<int> kept{0};
  ChannelServer server;
};

/// A run directory of the test's own, so that tests run in parallel and leave nothing, whatever happens.
class SegmentTest : public testing::Test {
 protected:
  SegmentTest() {
    std::string directory = (std::filesystem::temp_directory_path() / "corbot-channel-XXXXXX").string();
    if (::mkdtemp(directory.data()) == nullptr) ::abort();
    directory_ = directory;
    ::setenv("CORBOT_RUN_DIR", directory.c_str(), 1);
  }
  ~SegmentTest() override {
    ::unsetenv("CORBOT_RUN_DIR");
    std::filesystem::remove_all(directory_);
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::filesystem::path path() const { return directory_ / (name_ + ".sock"); }
  [[nodiscard]] bool exists() const { return std::filesystem::exists(path()); }

  [[nodiscard]] std::unique_ptr<TaskEnd> task(ChannelPolicy policy = {}) const {
    auto end = std::make_unique<TaskEnd>(name_, policy);
    end->serve();
    return end;
  }
  [[nodiscard]] std::unique_ptr<ServantPort> servant() const {
    return std::make_unique<ServantPort>(name_, kTestFingerprint, nullptr);
  }
  static std::shared_ptr<ServantChannel> connect(ServantPort& port) {
    return port.connect([] { return false; });
  }

  std::filesystem::path directory_;
  std::string name_{"arm"};
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
  /// kill -9, and wait until the kernel has taken it away: its connections are closed afterwards.
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
