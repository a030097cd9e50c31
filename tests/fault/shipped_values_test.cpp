// SPDX-License-Identifier: Apache-2.0
// A real-time task that is frozen, or computes without end, under the profile as it is shipped: what a client
// sees of it, and when. A busy machine makes a gap of 100 ms by itself, so each bound is that of the best of
// several tries.
#include <gmock/gmock.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "interop/controlled_operations.h"
#include "support/paths.h"
#include "support/robot_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

constexpr double kBound_s = 0.5;
constexpr double kFrozenAfter_s = 0.1;  // [loop] frozen_ms of the shipped profile
constexpr int kTries = 12;

double elapsed_s(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class ShippedValues : public RobotRig {
 protected:
  void SetUp() override {
    profile_ = CORBOT_SHIPPED_PROFILE;
    take_name("shipped");
    start();
    if (!HasFatalFailure()) settle();
  }
  void TearDown() override {
    if (rt_) rt_->signal(SIGCONT);
    RobotRig::TearDown();
  }
  /// At rest and ready, whatever gap the machine has made.
  void settle() {
    ASSERT_TRUE(wait_until(within(60), [&] {
      if (arm_->Status() == Corbot::Standby) return true;
      (void)raised_by([&] { arm_->Clear(); });
      return false;
    }));
  }
  [[nodiscard]] bool is_active(int code) const {
    const auto list = alarms();
    return std::any_of(list.begin(), list.end(), [&](const auto& a) { return a.code == code && a.active; });
  }
  /// Every call whose `raises` has NotReady, but those that need control, and the settings, which ask nothing
  /// of the task.
  static std::vector<Operation> refused_operations(Corbot::Ticket pending) {
    std::vector<Operation> all = guarded_operations();
    std::erase_if(all, [](const Operation& each) {
      const std::string name = each.first;
      return name == "Cancel" || name == "SetToolFrame" || name == "SetBaseFrame" || name == "ResetFrames";
    });
    all.emplace_back("Cancel", [pending](auto arm) { arm->Cancel(pending); });
    all.emplace_back("Stop", [](auto arm) { arm->Stop(); });
    all.emplace_back("StopAndHold", [](auto arm) { arm->StopAndHold(); });
    all.emplace_back("Clear", [](auto arm) { arm->Clear(); });
    all.emplace_back("Acquire", [](auto arm) { Corbot::Arm_var control = arm->Acquire("cell", 10); });
    return all;
  }
  /// Shortest so far, by name.
  void note(const std::string& what, double seconds) {
    const auto [at, is_new] = best_s_.emplace(what, seconds);
    if (!is_new) at->second = std::min(at->second, seconds);
  }
  [[nodiscard]] std::pair<std::string, double> slowest() const {
    return *std::max_element(best_s_.begin(), best_s_.end(),
                             [](const auto& a, const auto& b) { return a.second < b.second; });
  }
  /// While no cycle is made since `begin`: what each call answers, and after how long.
  void expect_that_it_is_reported(Clock::time_point begin, Corbot::Ticket pending) {
    ASSERT_TRUE(wait_until(within(30), [&] { return arm_->Status() == Corbot::Error; }));
    note("Status is Error", elapsed_s(begin));
    const double age_s = arm_->CycleAge();
    // A gap just before, of the machine's own, is an Error, too.
    if (!is_active(141)) {
      EXPECT_GT(age_s, 0.9 * kFrozenAfter_s) << "Error too early";
    }
    ASSERT_TRUE(wait_until(within(30), [&] { return is_active(153); }));
    for (const auto& [name, operation] : refused_operations(pending)) {
      const Clock::time_point asked = Clock::now();
      std::string reason = "nothing raised";
      try {
        operation(arm_.in());
      } catch (const Corbot::NotReady& error) {
        reason = error.reason;
      } catch (const CORBA::Exception& error) {
        reason = error._name();
      }
      note(name, elapsed_s(asked));
      EXPECT_THAT(reason, HasSubstr("does not respond: its last cycle was")) << name;
    }
    Clock::time_point asked = Clock::now();
    Corbot::MotionInfo_var info = arm_->Wait(pending, 30.0);  // has no NotReady
    note("Wait", elapsed_s(asked));
    EXPECT_LE(info->state, Corbot::MotionRunning) << "what becomes of it is open";
    // The values read are old, and the client can see how old.
    asked = Clock::now();
    const Corbot::JointCoord_var there = arm_->ArtiCoord();
    note("ArtiCoord", elapsed_s(asked));
    EXPECT_EQ(there->length(), 4u);
    const double later_s = arm_->CycleAge();
    EXPECT_GT(later_s, age_s);
    EXPECT_GE(later_s, kFrozenAfter_s);
    EXPECT_LT(later_s, elapsed_s(begin) + 30.0);
  }
  /// A caller who has been waiting when the cycle stood still, and what is raised to him.
  struct Waiter {
    explicit Waiter(Corbot::Arm_ptr arm, std::function<bool()> is_waiting)
        : thread([this, mine = Corbot::Arm::_duplicate(arm)] {
            Corbot::Arm_var held = mine;
            try {
              held->Delay(600);
            } catch (const Corbot::NotReady& error) {
              reason = error.reason;
            } catch (const CORBA::Exception& error) {
              reason = error._name();
            }
            ended = Clock::now();
          }) {
      EXPECT_TRUE(wait_until(within(30), is_waiting));
    }
    Waiter(const Waiter&) = delete;
    Waiter& operator=(const Waiter&) = delete;
    ~Waiter() {
      if (thread.joinable()) thread.join();
    }
    std::string reason;
    Clock::time_point ended;
    std::thread thread;
  };

  std::map<std::string, double> best_s_;
};

TEST_F(ShippedValues, AFrozenTaskIsErrorAndEveryCallSaysSoWithinHalfASecond) {
  for (int i = 0; i < kTries && (i == 0 || slowest().second >= kBound_s); ++i) {
    settle();
    if (HasFatalFailure()) return;
    Waiter waiter(arm_, [&] { return arm_->Status() != Corbot::Standby; });
    const Corbot::Ticket pending = [&]() -> Corbot::Ticket {
      try {
        return arm_->StartDelay(600);
      } catch (const Corbot::NotReady&) {
        return 0;  // the machine has made a gap: another try
      }
    }();
    if (pending == 0) continue;
    const Clock::time_point begin = Clock::now();
    rt_->signal(SIGSTOP);
    const bool is_disturbed = is_active(141);
    expect_that_it_is_reported(begin, pending);
    waiter.thread.join();
    if (!is_disturbed) {
      EXPECT_THAT(waiter.reason, HasSubstr("does not respond: its last cycle was"));
    }
    note("a Delay under way", std::chrono::duration<double>(waiter.ended - begin).count());
    rt_->signal(SIGCONT);
    ASSERT_TRUE(wait_until(within(30), [&] { return is_active(141); })) << "longer than gap_fault_ms";
    EXPECT_EQ(arm_->Status(), Corbot::Error);
  }
  settle();
  for (const auto& [what, seconds] : best_s_) fmt::print("{:<18} {:6.1f} ms\n", what, 1e3 * seconds);
  for (const auto& [what, seconds] : best_s_) EXPECT_LT(seconds, kBound_s) << what;
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->CycleAge() < kFrozenAfter_s; })) << "it runs again";
}

/// RLIMIT_RTTIME ends it only where it has real-time priority.
TEST_F(ShippedValues, ACycleThatSpinsIsReportedLikeAFrozenTask) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  for (int i = 0; i < kTries && (i == 0 || slowest().second >= kBound_s); ++i) {
    settle();
    if (HasFatalFailure()) return;
    Corbot::Ticket pending = 0;
    ASSERT_TRUE(wait_until(within(30), [&] {
      settle();
      return raised_by([&] { pending = arm_->StartDelay(600); }).empty();
    }));
    const pid_t loop = rt_->pid();  // the task's first thread
    const sched_param none{};
    ASSERT_EQ(::sched_setscheduler(loop, SCHED_OTHER, &none), 0);
    TracedThread thread(loop, loop);
    if (!thread.spin()) {
      thread.release();
      GTEST_SKIP() << "skipped: not known for this processor";
    }
    expect_that_it_is_reported(Clock::now(), pending);
    EXPECT_EQ(threads_of(loop).empty(), false) << "its process lives";
    rt_->signal(SIGKILL);
    ASSERT_TRUE(rt_->wait(within(30)));
    start_rt();
    if (HasFatalFailure()) return;
  }
  settle();
  for (const auto& [what, seconds] : best_s_) fmt::print("{:<18} {:6.1f} ms\n", what, 1e3 * seconds);
  for (const auto& [what, seconds] : best_s_) EXPECT_LT(seconds, kBound_s) << what;
}

}  // namespace
}  // namespace corbot::test
