// SPDX-License-Identifier: Apache-2.0
// Counts the instructions, the system calls and the wake-ups of a cycle of the real-time task. It does so
// with no thread and with two hundred threads that wait at the robot core. It counts by ptrace(2) on
// corbot-rt's loop, since virtual machines have no counter of instructions. Times do not matter: under the
// count a cycle takes milliseconds.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "config/load_profile.h"
#include "robot/robot.h"
#include "shm/channel_client.h"
#include "support/paths.h"
#include "support/process.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

constexpr int kWaiting = 200;
constexpr int kCycles = 20;

/// The counts over a number of cycles.
struct Count {
  std::vector<std::size_t> instructions;    // in user space, of each, sorted
  std::map<std::uint64_t, int> most_calls;  // of each system call, in a cycle
  std::uint32_t most_wakes{};               // in a cycle
  std::uint32_t wakes_of_end{};             // in those in which a motion ends, for which all wait
};

class Waiters : public ::testing::Test {
 protected:
  Waiters() : name_(unique_name("waiters")), profile_file_(write_profile()) {}
  ~Waiters() override {
    robot_.reset();
    channel_.reset();
    if (task_) {
      EXPECT_EQ(task_->terminate(), 0) << task_->errors();
    }
    EXPECT_FALSE(channel_exists(name_));
    std::remove(profile_file_.c_str());
  }

  /// With the longest period, for a traced cycle takes some milliseconds.
  [[nodiscard]] std::string write_profile() const {
    std::ifstream stream(CORBOT_TEST_PROFILE);
    std::string text{std::istreambuf_iterator<char>{stream}, {}};
    for (const auto& [from, to] : {std::pair{"period_us = 4000 ", "period_us = 20000 "},
                                   std::pair{"frozen_ms = 2000 ", "frozen_ms = 10000 "}}) {
      const std::size_t at = text.find(from);
      if (at == std::string::npos) throw std::runtime_error(std::string("no ") + from);
      text.replace(at, std::char_traits<char>::length(from), to);
    }
    std::string path = fmt::format("{}/{}.toml", CORBOT_SCRATCH_DIR, name_);
    std::ofstream(path) << text;
    return path;
  }

  void start() {
    task_ = std::make_unique<Process>(
        std::vector<std::string>{CORBOT_BIN_DIR "/corbot-rt", profile_file_, "--name", name_});
    ASSERT_TRUE(task_->wait_line("ready", within(30))) << task_->errors();
    robot_ = std::make_unique<Robot>(load_profile(profile_file_), name_);
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_STANDBY; }));
    channel_ = std::make_unique<Observer>(Observer::of(name_));
  }
  /// Runs the loop until it has just slept until its next cycle.
  static void run_to_begin(TracedThread& loop) {
    for (;;) {
      const auto call = loop.run_to_system_call();
      ASSERT_TRUE(call.has_value());
      if (*call == SYS_clock_nanosleep) return;
    }
  }
  /// Adds what one cycle asks of the kernel. False when the loop has ended.
  [[nodiscard]] bool count_calls(TracedThread& loop, Count& counted) {
    const std::uint32_t before = channel_->task().wake.load();
    std::map<std::uint64_t, int> calls;
    for (std::uint64_t call = 0; call != SYS_clock_nanosleep; ++calls[call]) {
      const auto made = loop.run_to_system_call();
      if (!made) return false;
      call = *made;
    }
    for (const auto& [call, times] : calls)
      counted.most_calls[call] = std::max(counted.most_calls[call], times);
    counted.most_wakes = std::max(counted.most_wakes, channel_->task().wake.load() - before);
    return true;
  }
  /// Counts cycles while a motion runs, and those that end it for a Stop.
  Count count() {
    Count counted;
    TracedThread loop(task_->pid(), task_->pid());  // the task's first thread
    run_to_begin(loop);
    const std::uint64_t begin = loop.instruction_pointer();
    for (int i = 0; i < kCycles; ++i) {
      std::size_t instructions = 0;
      do {
        if (!loop.step()) return {};
        ++instructions;
      } while (loop.instruction_pointer() != begin);
      counted.instructions.push_back(instructions);
    }
    std::sort(counted.instructions.begin(), counted.instructions.end());
    for (int i = 0; i < kCycles; ++i) {
      if (!count_calls(loop, counted)) return {};
    }
    const std::uint32_t wakes = channel_->task().wake.load();
    robot_->request_stop();
    for (int i = 0; i < kCycles; ++i) {
      if (!count_calls(loop, counted)) return {};
    }
    counted.wakes_of_end = channel_->task().wake.load() - wakes;
    return counted;
  }
  static void print(const char* what, const Count& counted) {
    fmt::print("{:<12} instructions a cycle: least {}, median {}, most {}; wakes at a motion's end: {}\n",
               what, counted.instructions.front(), counted.instructions[kCycles / 2],
               counted.instructions.back(), counted.wakes_of_end);
  }

  const std::string name_;
  const std::string profile_file_;
  std::unique_ptr<Process> task_;
  std::unique_ptr<Robot> robot_;
  std::unique_ptr<Observer> channel_;
};

/// Asleep in the kernel?
bool is_asleep(pid_t thread) {
  std::ifstream stream("/proc/self/task/" + std::to_string(thread) + "/stat");
  std::string text;
  std::getline(stream, text);
  const std::size_t name_end = text.rfind(')');
  return name_end != std::string::npos && text.compare(name_end, 3, ") S") == 0;
}

TEST_F(Waiters, TheCycleDoesTheSameForTwoHundredAsForNone) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  start();
  if (HasFatalFailure()) return;
  const auto begin_motion = [this] {
    const corbot_ticket ticket = robot_->accept(DwellRequest{600.0});
    EXPECT_TRUE(wait_until(within(30), [&] { return robot_->view().snapshot().command_id == ticket; }));
    return ticket;
  };
  (void)begin_motion();
  const Count none = count();

  const corbot_ticket ticket = begin_motion();
  std::vector<std::atomic<pid_t>> ids(kWaiting);
  std::vector<std::thread> waiting;
  for (int i = 0; i < kWaiting; ++i) {
    waiting.emplace_back([this, &ids, i, ticket] {
      ids[static_cast<std::size_t>(i)] = static_cast<pid_t>(::syscall(SYS_gettid));
      EXPECT_NE(robot_->wait(ticket, -1.0).state, CORBOT_MOTION_DONE);
    });
  }
  EXPECT_TRUE(wait_until(within(60), [&] {
    return std::all_of(ids.begin(), ids.end(), [](const auto& id) { return id != 0 && is_asleep(id); });
  }));
  const Count all = count();
  for (std::thread& each : waiting) each.join();

  ASSERT_EQ(none.instructions.size(), static_cast<std::size_t>(kCycles));
  ASSERT_EQ(all.instructions.size(), static_cast<std::size_t>(kCycles));
  print("nobody", none);
  print("two hundred", all);
  for (const Count& counted : {none, all}) {
    EXPECT_EQ(counted.most_wakes, 1u);
    for (const auto& [call, times] : counted.most_calls) {
      EXPECT_TRUE(call == SYS_clock_nanosleep || call == SYS_futex) << "system call " << call;
      EXPECT_EQ(times, 1) << "system call " << call;
    }
  }
  EXPECT_LE(all.wakes_of_end, none.wakes_of_end);
  // A look at each that waits would take three instructions at least; the way through the loop depends on the
  // clock, by two hundred or so.
  EXPECT_LT(all.instructions.front(), none.instructions.front() + 3 * kWaiting);
}

}  // namespace
}  // namespace corbot::test
