// SPDX-License-Identifier: Apache-2.0
#include "cli/conform/conform.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "cli/conform/checks.h"
#include "client/notice.h"
#include "client/stop_on_signal.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr const char* kRow = "{:<14}  {:<4}  {:<19}  {:<38}  {}\n";

void ask() {
  fmt::print(
      "This moves the arm: 3 cm to and fro near where it is, within 10 cm of there, joint 0 by 3 degrees (2 "
      "cm)\n"
      "from there, the gripper open and closed, and at last to Ready, all at {:g} % of the speed. It also "
      "calls\n"
      "what must be refused; a robot that accepts that may go anywhere. KEEP CLEAR, take out what the "
      "gripper\n"
      "holds, and have the emergency stop at hand. Type yes to begin: ",
      kLow_percent);
  std::fflush(stdout);
  std::string line;
  if (!std::getline(std::cin, line) || line != "yes")
    throw Failure(ExitCode::kUsage, "'yes' was not typed, and nothing has moved");
}

/// Measures how long this process stands still, as with a suspended machine. A duration that a check measures
/// meanwhile says nothing about the robot.
class Standstill {
 public:
  /// Returns the longest standstill since the last call, in seconds.
  [[nodiscard]] double longest_s() {
    const std::lock_guard lock(mutex_);
    look();
    return std::exchange(longest_s_, 0);
  }

 private:
  using Clock = std::chrono::steady_clock;

  void look() {
    const auto now = Clock::now();
    longest_s_ = std::max(longest_s_, std::chrono::duration<double>(now - looked_).count());
    looked_ = now;
  }
  void watch(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const std::lock_guard lock(mutex_);
      look();
    }
  }

  std::mutex mutex_;  ///< guards the next two
  Clock::time_point looked_{Clock::now()};
  double longest_s_{0};
  std::jthread thread_{[this](const std::stop_token& stop) { watch(stop); }};
};

/// Makes the checks and prints one row for each.
class Examination {
 public:
  explicit Examination(Session& session) : session_(session) {
    fmt::print(kRow, "RESULT", "CELL", "CHECK", "EXPECTED", "CAME");
  }
  [[nodiscard]] int failed() const { return failed_; }

  /// Makes the check again if this process stood still meanwhile.
  void make(const Check& check) {
    Row row;
    const bool was_lost = is_lost_;
    for (int tries = 1; tries <= kTries; ++tries) {
      (void)standstill_.longest_s();
      row = result_of(check);
      const double still_s = standstill_.longest_s();
      if (still_s < kLongestStill_s || tries == kTries) break;
      is_lost_ = was_lost;
      print(check, {"again", fmt::format("this machine stood still for {:.1f} s: {}", still_s, row.came)});
    }
    if (row.result != kHolds && check.is_for_cell) ++failed_;
    print(check, row);
  }

 private:
  struct Row {
    std::string result, came;
  };
  static constexpr const char* kHolds = "holds";
  static constexpr double kLongestStill_s = 0.2;
  static constexpr int kTries = 3;

  static void print(const Check& check, const Row& row) {
    fmt::print(kRow, row.result, check.is_for_cell ? "yes" : "", check.name, check.expected, row.came);
    std::fflush(stdout);
  }
  [[nodiscard]] Row result_of(const Check& check) {
    std::string result = "does not hold", came;
    try {
      if (is_lost_) throw Differs("not called: no reply before");
      came = client::call_user([&] { return check.examine(session_); });
      result = kHolds;
    } catch (const Differs& e) {
      came = e.what();
    } catch (const Failure& e) {
      came = e.what();
    } catch (const CORBA::BAD_OPERATION& e) {
      result = "not there", came = e._name();
    } catch (const CORBA::NO_IMPLEMENT& e) {
      result = "not there", came = e._name();
    } catch (const CORBA::SystemException& e) {
      is_lost_ = client::is_call_timeout(e);
      came = is_lost_ ? "no reply in time" : e._name();
    }
    return {result, came};
  }

  Session& session_;
  Standstill standstill_;
  bool is_lost_{false};
  int failed_{0};
};

/// Returns the number of checks that the cell needs and that do not hold.
int examine(Session& session, const client::OnSignal& on_signal) {
  client::call(session.address(), [&] {
    try {
      session.slow_down();
    } catch (const CORBA::BAD_OPERATION&) {  // NOLINT(bugprone-empty-catch): nothing moves
    } catch (const CORBA::NO_IMPLEMENT&) {   // NOLINT(bugprone-empty-catch): the same
    }
  });
  Examination examination(session);
  for (const auto checks : {read_checks(), motion_checks()}) {
    for (const Check& check : checks) {
      if (!on_signal.seen()) examination.make(check);
    }
  }
  session.restore_speed();
  return examination.failed();
}

}  // namespace

void conform(const client::Address& address, double timeout_s, bool is_agreed) {
  if (!is_agreed && ::isatty(STDIN_FILENO) != 1)
    throw Failure(ExitCode::kUsage,
                  "this command moves the arm, and standard input is no terminal for the question: give "
                  "--yes to agree");
  if (!is_agreed) ask();
  std::atomic<Session*> begun{nullptr};
  std::optional<Session> session;  // outlives the signal's thread, which uses it
  client::OnSignal on_signal([&] {
    Session* const now = begun.load();
    if (now == nullptr) ::_exit(static_cast<int>(ExitCode::kStopped));  // nothing moves yet
    client::notice(
        stderr, "\ncorbot: ends after the motion under way, and stops that motion if the robot has Stop\n");
    now->end();
  });
  begun = &session.emplace(address, timeout_s);
  const int failed = examine(*session, on_signal);
  if (on_signal.seen()) {
    on_signal.join();
    throw Failure(ExitCode::kStopped, "the examination was ended by " + on_signal.describe());
  }
  if (failed > 0)
    throw Failure(ExitCode::kRefused,
                  fmt::format("{} of the checks that the pick-and-place cell needs {} not hold", failed,
                              failed == 1 ? "does" : "do"));
  fmt::print("All that the pick-and-place cell needs holds.\n");
}

}  // namespace corbot::cli
