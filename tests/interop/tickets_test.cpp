// SPDX-License-Identifier: Apache-2.0
// Motions without waiting: tickets, time-outs, progress, order, and the memory of a thousand.
#include <atomic>
#include <thread>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Tickets : public RobotRig {};

TEST_F(Tickets, CountUpwardAndEndDone) {
  const Corbot::Ticket first = arm_->StartMove(0.20, 0.05, 0.10, 0.0, 0.0);
  const Corbot::Ticket second = arm_->StartMoveS(0.20, -0.05, 0.10, 0.0, 0.0);
  const Corbot::Ticket third = arm_->StartMoveC({0.20, -0.05, 0.10}, {0.22, 0.0, 0.10}, {0.20, 0.05, 0.10});
  const Corbot::Ticket fourth = arm_->StartOpen();
  EXPECT_LT(first, second);
  EXPECT_LT(second, third);
  EXPECT_LT(third, fourth);
  Corbot::MotionInfo_var info = arm_->Wait(fourth, 60.0);
  EXPECT_EQ(info->state, Corbot::MotionDone);
  for (const Corbot::Ticket ticket : {first, second, third, fourth}) {
    info = arm_->Progress(ticket);
    EXPECT_EQ(info->id, ticket);
    EXPECT_EQ(info->state, Corbot::MotionDone);
    EXPECT_EQ(info->progress, 1.0);
    EXPECT_STREQ(info->reason, "");
  }
}

TEST_F(Tickets, WaitEndsWithItsTime) {
  const Corbot::Ticket ticket = arm_->StartDelay(600.0);
  const Corbot::Ticket behind = arm_->StartReady();
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 0.05);
  EXPECT_TRUE(info->state == Corbot::MotionRunning || info->state == Corbot::MotionQueued);
  info = arm_->Wait(behind, 0.0);
  EXPECT_EQ(info->state, Corbot::MotionQueued);
  EXPECT_EQ(info->progress, 0.0);
  EXPECT_EQ(info->duration, 0.0) << "the arm is at Ready already";
  arm_->Stop();
}

TEST_F(Tickets, ProgressRises) {
  const Corbot::Ticket ticket = arm_->StartDelay(1.0);
  double last = 0.0;
  ASSERT_TRUE(wait_until(within(30), [&] {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    EXPECT_GE(info->progress, last);
    last = info->progress;
    return last > 0.3;
  }));
  EXPECT_LE(last, 1.0);
}

TEST_F(Tickets, TwoClientsAreServedInTheOrderOfTheirCalls) {
  const Corbot::Arm_var other = connect();
  const Corbot::Ticket long_one = arm_->StartDelay(0.3);
  bool done_first = false;
  std::thread second([&] {
    other->Move(0.20, 0.05, 0.10, 0.0, 0.0);
    Corbot::MotionInfo_var info = other->Progress(long_one);
    done_first = info->state == Corbot::MotionDone;
  });
  second.join();
  EXPECT_TRUE(done_first);
}

TEST_F(Tickets, TheLastThousandAreKept) {
  const Corbot::Ticket first = arm_->StartDelay(0.0);
  Corbot::Ticket last = first;
  for (int i = 0; i < 1000; ++i) {
    while (raised_by([&] { last = arm_->StartDelay(0.0); }) == "QueueFull") {
      Corbot::MotionInfo_var info = arm_->Wait(last, 10.0);
    }
  }
  Corbot::MotionInfo_var info = arm_->Wait(last, 60.0);
  EXPECT_EQ(info->state, Corbot::MotionDone);
  for (Corbot::Ticket ticket = last - 999; ticket <= last; ++ticket) {
    info = arm_->Progress(ticket);
    EXPECT_EQ(info->state, Corbot::MotionDone) << ticket;
  }
}

TEST_F(Tickets, FourWaitsDoNotHoldUpAStop) {
  constexpr int kWaiters = 4;  // of one host
  const Corbot::Ticket ticket = arm_->StartDelay(600.0);
  std::vector<std::thread> waiters;
  std::atomic<int> stopped{0};
  for (int i = 0; i < kWaiters; ++i) {
    waiters.emplace_back([&] {
      Corbot::MotionInfo_var info = arm_->Wait(ticket, 600.0);
      if (info->state == Corbot::MotionStopped) ++stopped;
    });
  }
  arm_->Stop();
  for (auto& waiter : waiters) waiter.join();
  EXPECT_EQ(stopped, kWaiters);
}

}  // namespace
}  // namespace corbot::test
