// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "segment_fixture.h"

// Stop requests: of the servant, and by the stop segment.

namespace corbot {
namespace {

using StopTest = SegmentTest;

/// A client that may stop the robot sees by the same connection that the robot has stopped.
TEST_F(StopTest, AStopIsConfirmedByACycleThatHasReadIt) {
  using Outcome = StopPort::Outcome;
  const auto rt = task();
  Snapshot now{};
  now.incarnation = rt->task->incarnation;
  const auto step = [&](RtState state, std::uint64_t stops_done) {
    ++now.cycle;
    now.state = state;
    now.stops_done = stops_done;
    rt->task->snapshot.store(now);
  };
  step(RtState::kMoving, 5);
  StopPort port = StopPort::of(name());
  port.request();
  EXPECT_EQ(port.outcome(), Outcome::kPending);
  step(RtState::kStandby, 6);  // another's stop, in a cycle that may have begun before the request
  EXPECT_EQ(port.outcome(), Outcome::kPending);
  step(RtState::kStopping, 6);
  EXPECT_EQ(port.outcome(), Outcome::kPending);
  step(RtState::kStandby, 7);
  EXPECT_EQ(port.outcome(), Outcome::kAtRest);
}

TEST_F(StopTest, AFaultThatSlowsTheArmDownIsNotRest) {
  using Outcome = StopPort::Outcome;
  const auto rt = task();
  Snapshot now{};
  now.incarnation = rt->task->incarnation;
  rt->task->snapshot.store(now);
  StopPort port = StopPort::of(name());
  port.request();
  now.cycle += 2;
  now.state = RtState::kError;
  now.flags = kSnapshotFaultStop;
  now.stops_done = 1;
  rt->task->snapshot.store(now);
  EXPECT_EQ(port.outcome(), Outcome::kPending);
  EXPECT_EQ(rt->stop->count.load(), 1u) << "the fault stops the arm";
  now.flags = kSnapshotPowerOff;
  rt->task->snapshot.store(now);
  EXPECT_EQ(port.outcome(), Outcome::kAtRest);
}

TEST_F(StopTest, AStopThatIsTakenBackIsCountedAgain) {
  using Outcome = StopPort::Outcome;
  const auto rt = task();
  Snapshot now{};
  now.incarnation = rt->task->incarnation;
  rt->task->snapshot.store(now);
  StopPort port = StopPort::of(name());
  port.request();
  rt->stop->count.store(0);  // by another of the group, before the cycle has looked
  for (int i = 0; i < 2; ++i) {
    now.cycle += 1;
    now.state = RtState::kMoving;
    rt->task->snapshot.store(now);
    EXPECT_EQ(port.outcome(), Outcome::kPending);
  }
  EXPECT_EQ(rt->stop->count.load(), 1u);
  now.cycle += 2;
  now.state = RtState::kError;
  rt->task->snapshot.store(now);
  EXPECT_EQ(port.outcome(), Outcome::kAtRest) << "held by an Error";
}

TEST_F(StopTest, AStopBeforeTheFirstCycleIsCountedAgain) {
  const auto rt = task();
  rt->task->incarnation = 9;
  Snapshot taken_over{};
  taken_over.incarnation = 8;
  rt->task->snapshot.store(taken_over);
  StopPort port = StopPort::of(name());
  port.request();
  EXPECT_EQ(port.outcome(), StopPort::Outcome::kPending);
  Snapshot now{};
  now.incarnation = 9;
  rt->task->snapshot.store(now);
  EXPECT_EQ(port.outcome(), StopPort::Outcome::kPending);
  EXPECT_EQ(rt->stop->count.load(), 2u);
}

TEST_F(StopTest, AServantsStopHasALaterNumberThanAllThatItPlannedUnder) {
  const auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  Snapshot now{};
  now.stops_done = 41;
  rt->task->snapshot.store(now);
  EXPECT_EQ(channel->stops(), 41u);
  EXPECT_EQ(channel->request_stop(), 42u);
  EXPECT_EQ(channel->stops(), 42u);
  now.stops_done = 50;  // by others
  rt->task->snapshot.store(now);
  EXPECT_EQ(channel->stops(), 50u);
  EXPECT_EQ(channel->request_stop(), 51u);
}

}  // namespace
}  // namespace corbot
