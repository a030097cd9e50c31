// SPDX-License-Identifier: Apache-2.0
// Stop, pause, resume, override; a Stop gets through whatever else the same client waits for.
#include <atomic>
#include <thread>

#include <fmt/core.h>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Stop : public RobotRig {
 protected:
  /// Waits until a motion runs.
  void await_motion() {
    ASSERT_TRUE(wait_for(Corbot::Waiting));
    Corbot::JointCoord_var first = arm_->ArtiCoord();
    ASSERT_TRUE(wait_until(within(30), [&] {
      Corbot::JointCoord_var now = arm_->ArtiCoord();
      return distance_deg(first, now) > 0.1;
    }));
  }
  bool at_rest() {
    Corbot::JointCoord_var first = arm_->ArtiCoord();
    const std::uint64_t cycles = cycle_count();
    wait_until(within(30), [&] { return cycle_count() >= cycles + 100; });
    Corbot::JointCoord_var now = arm_->ArtiCoord();
    return distance_deg(first, now) == 0.0;
  }
  std::uint64_t cycle_count() {
    Corbot::LoopInfo_var info = arm_->Diagnostics();
    return info->cycles;
  }
};

TEST_F(Stop, EndsTheMotionAndItsCaller) {
  std::string raised;
  std::thread caller([&] { raised = raised_by([&] { arm_->Move(0.20, 0.10, 0.10, 0.0, 20.0); }); });
  await_motion();
  arm_->Stop();
  EXPECT_TRUE(at_rest());
  caller.join();
  EXPECT_EQ(raised, "Stopped");
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  arm_->Move(0.20, 0.0, 0.10, 0.0, 0.0);  // and the arm continues from where it is
  EXPECT_NEAR(arm_->CartCoord().y, 0.0, 1e-6);
}

TEST_F(Stop, DiscardsWhatIsQueued) {
  const Corbot::Ticket first = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 20.0);
  const Corbot::Ticket second = arm_->StartMove(0.20, -0.10, 0.10, 0.0, 20.0);
  await_motion();
  arm_->Stop();
  Corbot::MotionInfo_var info = arm_->Progress(first);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
  info = arm_->Progress(second);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
  EXPECT_STRNE(info->reason, "");
  EXPECT_TRUE(at_rest());
}

TEST_F(Stop, AtRestSucceeds) {
  arm_->Stop();
  arm_->Stop();
  arm_->Ready();
}

TEST_F(Stop, GetsThroughWhileEveryOtherCallOfTheClientBlocks) {
  constexpr int kCalls = 12;
  constexpr int kWaiting = 4;  // of one host; the others are refused
  std::atomic<int> stopped{0};
  std::atomic<int> refused{0};
  std::vector<std::thread> callers;
  for (int i = 0; i < kCalls; ++i) {
    callers.emplace_back([&] {
      const std::string raised = raised_by([&] { arm_->Delay(600.0); });
      if (raised == "Stopped") ++stopped;
      if (raised == "QueueFull") ++refused;
    });
  }
  // Tickets count from 1 in a fresh segment: the calls have theirs when the last number is known.
  ASSERT_TRUE(wait_until(within(30), [&] {
    return refused == kCalls - kWaiting &&
           raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(kWaiting); }).empty();
  }));
  const auto begin = std::chrono::steady_clock::now();
  arm_->Stop();
  const double stop_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (auto& caller : callers) caller.join();
  fmt::print("Stop among {} blocked calls: {:.1f} ms\n", kCalls, 1e3 * stop_s);
  EXPECT_LT(stop_s, 30.0) << "a Stop that waited for a call would have taken minutes";
  EXPECT_EQ(stopped, kWaiting);
}

TEST_F(Stop, ReadsAreNotHeldUpByAMotion) {
  const Corbot::Ticket ticket = arm_->StartDelay(600.0);
  for (int i = 0; i < 100; ++i) {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    (void)arm_->CartCoord();
    EXPECT_EQ(arm_->Status(), Corbot::Waiting);
  }
  Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_TRUE(info->state == Corbot::MotionRunning || info->state == Corbot::MotionQueued);
  arm_->Stop();
}

TEST_F(Stop, PauseHoldsAndResumeGoesOn) {
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 3.0);
  await_motion();
  arm_->Pause();
  ASSERT_TRUE(wait_until(within(30), [&] { return at_rest(); }));
  EXPECT_EQ(arm_->Status(), Corbot::Waiting);
  Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_EQ(info->state, Corbot::MotionRunning);
  EXPECT_GT(info->progress, 0.0);
  EXPECT_LT(info->progress, 1.0);
  arm_->Resume();
  info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionDone);
  EXPECT_NEAR(arm_->CartCoord().y, 0.10, 1e-6);
}

TEST_F(Stop, WorksWhilePaused) {
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 5.0);
  await_motion();
  arm_->Pause();
  arm_->Stop();
  Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
  // Another client may have paused the arm: a Stop does not resume it.
  EXPECT_TRUE(arm_->Paused());
  const Corbot::Ticket next = arm_->StartReady();
  EXPECT_EQ(arm_->Status(), Corbot::Waiting);
  arm_->Resume();
  info = arm_->Wait(next, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionDone);
  EXPECT_FALSE(arm_->Paused());
}

TEST_F(Stop, CancelTakesBackOneMotionAndWhatIsBehindIt) {
  const Corbot::Ticket first = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 1.0);
  await_motion();
  arm_->Pause();
  const Corbot::Ticket second = arm_->StartMove(0.20, -0.10, 0.10, 0.0, 1.0);
  const Corbot::Ticket third = arm_->StartReady();
  arm_->Cancel(second);
  const Corbot::Ticket next = arm_->StartMove(0.20, 0.0, 0.10, 0.0, 0.0);
  arm_->Resume();
  const auto end_of = [&](Corbot::Ticket ticket) {
    const Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
    return info->state;
  };
  EXPECT_EQ(end_of(second), Corbot::MotionStopped);
  EXPECT_EQ(end_of(third), Corbot::MotionStopped);
  EXPECT_EQ(end_of(first), Corbot::MotionDone);
  EXPECT_EQ(end_of(next), Corbot::MotionDone);
  EXPECT_NEAR(arm_->CartCoord().y, 0.0, 1e-6);
  arm_->Cancel(next);  // has ended
  EXPECT_EQ(raised_by([&] { arm_->Cancel(next + 100); }), "BadParameter");
}

TEST_F(Stop, OverrideSlowsAMotionUnderWay) {
  const auto begin = std::chrono::steady_clock::now();
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 1.0);
  arm_->Override(25.0);
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 60.0);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_EQ(info->state, Corbot::MotionDone);
  EXPECT_GT(took_s, 2.0);
  EXPECT_NEAR(arm_->OverridePercent(), 25.0, 1e-9);
  arm_->Override(100.0);
}

}  // namespace
}  // namespace corbot::test
