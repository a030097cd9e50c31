// SPDX-License-Identifier: Apache-2.0
// Processes frozen by SIGSTOP: what the other side reports, what it does, and what becomes of a motion.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <fmt/core.h>

#include "corbot/channel/layout.h"
#include "corbot/running_time.h"
#include "shm/channel_client.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Freeze : public RobotRig {
 protected:
  void SetUp() override {
    profile_ = write_profile(gap_fault_ms());
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    channel_ = std::make_unique<Observer>(Observer::of(name_));
  }
  void TearDown() override {
    if (rt_) rt_->signal(SIGCONT);
    if (servant_) servant_->signal(SIGCONT);
    channel_.reset();
    RobotRig::TearDown();
    std::filesystem::remove(profile_);
  }
  /// Not the shipped 100 ms: a busy machine makes such gaps by itself.
  [[nodiscard]] virtual int gap_fault_ms() const { return 5000; }  // longer than a machine stands still

  static std::string write_profile(int gap_fault_ms) {
    std::ifstream stream(CORBOT_TEST_PROFILE);
    std::string text{std::istreambuf_iterator<char>{stream}, {}};
    const std::string wide = "gap_fault_ms = 10000 ";
    text.replace(text.find(wide), wide.size(), fmt::format("gap_fault_ms = {} ", gap_fault_ms));
    const std::string patient = "frozen_ms = 2000 ";
    text.replace(text.find(patient), patient.size(), "frozen_ms = 100 ");
    const std::string path = fmt::format("{}/{}.toml", CORBOT_SCRATCH_DIR, unique_name("freeze"));
    std::ofstream(path) << text;
    return path;
  }
  [[nodiscard]] Snapshot newest() const {
    Snapshot snapshot{};
    (void)last_snapshot(channel_->task(), snapshot);
    return snapshot;
  }
  [[nodiscard]] bool is_active(int code) const {
    const auto list = alarms();
    return std::any_of(list.begin(), list.end(), [&](const auto& a) { return a.code == code && a.active; });
  }
  [[nodiscard]] bool has_alarm(int code) const {
    const auto list = alarms();
    return std::any_of(list.begin(), list.end(), [&](const auto& a) { return a.code == code; });
  }
  /// A motion of some seconds, from where the arm is at rest.
  Corbot::Ticket start_long_motion() {
    Corbot::JointCoord target;
    target.length(4);
    for (CORBA::ULong i = 0; i < 4; ++i) target[i] = 20.0;
    const Corbot::Ticket ticket = arm_->StartMoveJoints(target, 8.0);
    EXPECT_TRUE(wait_until(within(30), [&] { return newest().state == RtState::kMoving; }));
    return ticket;
  }

  std::unique_ptr<Observer> channel_;
};

TEST_F(Freeze, AFrozenTaskIsReportedAndItsGapNeedsAClear) {
  const Corbot::Ticket ticket = start_long_motion();
  std::string waiter;
  std::thread waiting([&] {
    Corbot::Arm_var mine = connect();
    waiter = raised_by([&] { mine->Delay(0.1); });  // behind the long motion
  });
  ASSERT_TRUE(wait_until(within(30), [&] {
    return ring_size(channel_->servant()->commands, channel_->task().commands_tail) > 0;
  }));
  const Clock::time_point frozen = Clock::now();
  rt_->signal(SIGSTOP);
  // Without what this process itself stands still for, as the machine may.
  RunningTime noticed(std::chrono::milliseconds(20), frozen);
  EXPECT_TRUE(wait_until(within(30), [&] {
    (void)noticed.look(Clock::now());
    return arm_->Status() == Corbot::Error;
  }));
  const double noticed_s = std::chrono::duration<double>(noticed.passed()).count();
  EXPECT_TRUE(wait_until(within(30), [&] { return is_active(153); }));
  waiting.join();
  EXPECT_EQ(waiter, "NotReady");
  const Clock::time_point polled = Clock::now();
  Corbot::MotionInfo_var open = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(open->state, Corbot::MotionRunning) << "what becomes of it is open";
  EXPECT_GT(seconds_since(polled), 0.1) << "or a client that polls would do nothing else";
  EXPECT_LT(seconds_since(polled), 25.0) << "not for as long as was asked for";
  expect_no_motion_accepted();
  std::string reason;
  double stop_s = HUGE_VAL;  // of several, for the machine may stand still during one
  for (int i = 0; i < 5; ++i) {
    const Clock::time_point asked = Clock::now();
    try {
      arm_->Stop();
    } catch (const Corbot::NotReady& error) {
      reason = error.reason;
    }
    stop_s = std::min(stop_s, seconds_since(asked));
  }
  EXPECT_NE(reason.find("does not respond: its last cycle was"), std::string::npos) << reason;
  EXPECT_NE(reason.find("the stop is counted, and takes effect when a task runs"), std::string::npos)
      << reason;
  fmt::print("noticed after {:.0f} ms, a Stop answered after {:.0f} ms\n", 1e3 * noticed_s, 1e3 * stop_s);
  EXPECT_LT(noticed_s, 5.0) << "half a second, and more for a busy machine";
  EXPECT_LT(stop_s, 5.0) << "it waits for no answer of the task";

  const Joints here = newest().position_q;
  ASSERT_TRUE(wait_until(within(30), [&] { return seconds_since(frozen) > 5.5; })) << "a gap that is a fault";
  rt_->signal(SIGCONT);
  EXPECT_TRUE(wait_until(within(30), [&] { return !is_active(153); }));
  EXPECT_TRUE(wait_until(within(30), [&] { return has_alarm(141); }));
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  EXPECT_EQ(newest().position_q, here) << "as last commanded";
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionFailed);
  arm_->Clear();
  EXPECT_TRUE(wait_for(Corbot::Standby));
  EXPECT_EQ(newest().position_q, here);
}

/// Gaps that are no fault.
class ShortFreeze : public Freeze {
 protected:
  [[nodiscard]] int gap_fault_ms() const override { return 10000; }
};

TEST_F(ShortFreeze, TheMotionBeginsAgainFromRest) {
  const Corbot::Ticket ticket = start_long_motion();
  ASSERT_TRUE(wait_until(within(30), [&] { return newest().virtual_time_s > 2.0; }));
  rt_->signal(SIGSTOP);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->Status() == Corbot::Error; }));
  const std::uint64_t end = channel_->task().trace.next();
  rt_->signal(SIGCONT);
  ASSERT_TRUE(wait_until(within(30), [&] { return channel_->task().trace.next() > end + 20; }));
  // The first step after the gap is already one of rate 0 that ramps up, not one at full speed.
  for (std::uint64_t i = end; i < end + 3; ++i) {
    Snapshot now{};
    ASSERT_TRUE(channel_->task().trace.read(i, now));
    EXPECT_LT(now.virtual_rate, 0.5) << "cycle " << i - end << " after the gap";
  }
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  while (info->state == Corbot::MotionRunning) info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionDone) << info->reason.in();
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  Corbot::AlarmList_var all = arm_->Alarms();
  bool is_reported = false;
  for (CORBA::ULong i = 0; i < all->length(); ++i)
    is_reported = is_reported || (all[i].code == 140 && !all[i].active);
  EXPECT_TRUE(is_reported) << "periods were missed";
}

TEST_F(ShortFreeze, AStopDuringItIsCarriedOutAtItsEnd) {
  const Corbot::Ticket ticket = start_long_motion();
  const std::uint64_t stops = newest().stops_done;
  rt_->signal(SIGSTOP);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->Status() == Corbot::Error; }));
  const Joints here = newest().position_q;
  EXPECT_EQ(raised_by([&] { arm_->Stop(); }), "NotReady") << "not carried out yet";
  rt_->signal(SIGCONT);
  ASSERT_TRUE(wait_until(within(30), [&] { return newest().stops_done == stops + 1; }));
  EXPECT_EQ(newest().position_q, here);
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
}

TEST_F(ShortFreeze, AMotionWithoutAServantIsStopped) {
  const Corbot::Ticket ticket = start_long_motion();
  servant_->signal(SIGSTOP);
  const Clock::time_point frozen = Clock::now();
  ASSERT_TRUE(wait_until(within(30), [&] { return newest().state == RtState::kStandby; }));
  const double stopped_s = seconds_since(frozen);
  fmt::print("stopped {:.2f} s after the servant froze\n", stopped_s);
  EXPECT_GT(stopped_s, 1.9) << "orphan_s is 2";
  EXPECT_LT(newest().position_q[0], 20.0 * 3.14 / 180.0 * 0.9) << "on its path";
  servant_->signal(SIGCONT);
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionFailed);
  EXPECT_NE(std::string(info->reason.in()).find("no servant responded"), std::string::npos)
      << info->reason.in();
  EXPECT_TRUE(wait_until(within(30), [&] { return has_alarm(143); }));
  EXPECT_EQ(arm_->Status(), Corbot::Standby) << "no Clear is needed";
  EXPECT_EQ(raised_by([&] { arm_->Delay(0.01); }), "");
}

TEST_F(ShortFreeze, AServantThatIsBackLetsTheMotionRunOn) {
  const Corbot::Ticket ticket = start_long_motion();
  // Each time for far less than orphan_s, for this process may be held up; together for longer.
  for (int i = 0; i < 6; ++i) {
    servant_->signal(SIGSTOP);
    const double until_s = newest().virtual_time_s + 0.5;
    ASSERT_TRUE(wait_until(within(30), [&] {
      return newest().virtual_time_s > until_s || newest().state == RtState::kStandby;
    }));
    ASSERT_EQ(newest().state, RtState::kMoving);
    servant_->signal(SIGCONT);
    const std::uint32_t beat = channel_->servant()->control.servant_beat.load();
    ASSERT_TRUE(
        wait_until(within(30), [&] { return channel_->servant()->control.servant_beat.load() != beat; }));
  }
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_EQ(info->state, Corbot::MotionDone) << info->reason.in();
  EXPECT_FALSE(has_alarm(143));
}

TEST_F(ShortFreeze, ATaskInPlaceOfAFrozenOneBeginsInError) {
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  start_rt({"--after-gap"});
  ASSERT_TRUE(wait_until(within(30), [&] { return has_alarm(142) && has_alarm(151); })) << "connected, too";
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  expect_no_motion_accepted();
  arm_->Clear();
  EXPECT_TRUE(wait_for(Corbot::Standby));
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  start_rt();
  EXPECT_TRUE(wait_for(Corbot::Standby)) << "a task that only died needs no Clear";
}

}  // namespace
}  // namespace corbot::test
