// SPDX-License-Identifier: Apache-2.0
// A Stop stops every call that has entered the robot before it, and the calls that start motions are bounded.
#include "robot/task_fixture.h"

namespace corbot::test::stop_order_test {
namespace {

class StopOrder : public TaskTest {
 protected:
  void SetUp() override {
    task_.run();
    open_robot();
  }
  void TearDown() override {
    if (other_.joinable()) other_.join();
    robot_.reset();
  }

  /// A Stop of some other client: counted, and not carried out until the test says so.
  void begin_stop() {
    other_ = std::thread([this] { EXPECT_EQ(status_of([&] { robot_->stop(); }), CORBOT_OK); });
    ASSERT_TRUE(wait_until(within(30), [&] { return task_.stop_count() == 1; }));
    task_.change([](Snapshot& now) { now.state = RtState::kStopping; });
  }
  void end_stops() {
    const std::uint64_t count = task_.stop_count();
    task_.change([&](Snapshot& now) {
      now.stops_done = count;
      now.state = RtState::kStandby;
    });
  }
  /// As many calls as may start a motion, all in the robot and none planned.
  void enter_all() {
    begin_stop();
    outcomes_.resize(static_cast<std::size_t>(profile_.queue_capacity));
    for (Outcome& outcome : outcomes_)
      calls_.emplace_back([this, &outcome] { outcome = try_accept(DwellRequest{1.0}); });
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->starting() == profile_.queue_capacity; }));
  }
  void join_all() {
    for (std::thread& call : calls_) call.join();
  }

  FakeTask task_{name_, profile_.arm};
  std::vector<Outcome> outcomes_;
  std::vector<std::thread> calls_;
  std::thread other_;
};

TEST_F(StopOrder, WhatEnteredBeforeAStopIsStopped) {
  enter_all();
  std::thread stop([&] { EXPECT_EQ(status_of([&] { robot_->stop(); }), CORBOT_OK); });
  ASSERT_TRUE(wait_until(within(30), [&] { return task_.stop_count() == 2; }));
  end_stops();
  stop.join();
  join_all();
  for (const Outcome& outcome : outcomes_) EXPECT_EQ(outcome.status, CORBOT_STOPPED) << outcome.text;
  EXPECT_EQ(task_.queued(), 0u) << "handed over after the Stop";
  const Outcome later = try_accept(DwellRequest{1.0});
  EXPECT_EQ(later.status, CORBOT_OK) << later.text;
}

TEST_F(StopOrder, WhatArrivedBeforeAStopIsStoppedHoweverLateItsThreadBegins) {
  task_.change([](Snapshot& now) { now.stops_done = 1; });  // another process's
  const StopCounts arrival = robot_->stops();
  EXPECT_EQ(arrival.all, 1u);
  EXPECT_EQ(arrival.by_others, 1u);
  other_ = std::thread([this] { EXPECT_EQ(status_of([&] { robot_->stop(); }), CORBOT_OK); });
  ASSERT_TRUE(wait_until(within(30), [&] { return task_.stop_count() == 2; }));
  end_stops();
  other_.join();
  EXPECT_EQ(try_accept(DwellRequest{1.0}, arrival.all).status, CORBOT_STOPPED);
  EXPECT_EQ(task_.queued(), 0u);
  EXPECT_EQ(robot_->stops().by_others, 1u) << "its own";
  const Outcome later = try_accept(DwellRequest{1.0}, robot_->stops().all);
  EXPECT_EQ(later.status, CORBOT_OK) << later.text;
}

TEST_F(StopOrder, ManyStopsAreAwaitedTogether) {
  for (int i = 0; i < 3; ++i) robot_->request_stop();
  EXPECT_EQ(task_.stop_count(), 3u) << "counted at once";
  other_ = std::thread([this] { EXPECT_EQ(status_of([&] { robot_->await_requested_stops(); }), CORBOT_OK); });
  end_stops();
  other_.join();
}

TEST_F(StopOrder, AStopThatWasCountedOnArrivalIsCountedOnce) {
  const corbot_counted_stop counted = robot_->count_stop();
  EXPECT_EQ(counted.counted, 1);
  EXPECT_EQ(task_.stop_count(), 1u) << "before its call begins";
  EXPECT_EQ(robot_->stops().by_others, 0u);
  other_ = std::thread([&] { EXPECT_EQ(status_of([&] { robot_->stop(counted); }), CORBOT_OK); });
  end_stops();
  other_.join();
  robot_->request_stop(robot_->count_stop());
  robot_->request_stop_and_hold("a person", robot_->count_stop(true));
  EXPECT_EQ(task_.stop_count(), 3u);
  EXPECT_EQ(task_.servant().control.hold_count.load(), 1u);
}

/// The calls wait for the end of their stop all the same, and what was planned before it is stopped.
TEST_F(StopOrder, AStopThatWasCountedOnArrivalIsWaitedFor) {
  task_.change([](Snapshot& now) { now.stops_done = 1; });  // another process's: 0 means that it is not known
  const std::uint64_t before = robot_->stops().all;
  const corbot_counted_stop counted = robot_->count_stop();
  std::atomic<bool> has_returned{false};
  other_ = std::thread([&] {
    EXPECT_EQ(status_of([&] { robot_->stop(counted); }), CORBOT_OK);
    has_returned = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(has_returned);
  end_stops();
  other_.join();
  EXPECT_EQ(try_accept(DwellRequest{1.0}, before).status, CORBOT_STOPPED);
}

TEST_F(StopOrder, WithoutATaskNothingIsCountedOnArrivalAndTheStopIsRefused) {
  task_.die();
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_ERROR; }));
  const corbot_counted_stop counted = robot_->count_stop();
  EXPECT_EQ(counted.counted, 0);
  EXPECT_EQ(status_of([&] { robot_->stop(counted); }), CORBOT_NOT_READY);
}

TEST_F(StopOrder, WhatCameAfterTheStopWaitsForItsEnd) {
  enter_all();
  end_stops();
  join_all();
  for (const Outcome& outcome : outcomes_) EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
}

TEST_F(StopOrder, CallsThatStartAMotionAreBoundedInNumber) {
  enter_all();
  EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_QUEUE_FULL);
  end_stops();
  join_all();
}

TEST_F(StopOrder, CallsThatStartAMotionAreBoundedInTimeAndStopIsNotBehindThem) {
  enter_all();
  std::thread stop([&] { EXPECT_EQ(status_of([&] { robot_->pause(true); }), CORBOT_OK); });
  stop.join();  // with all of them in the robot
  join_all();
  for (const Outcome& outcome : outcomes_) {
    EXPECT_EQ(outcome.status, CORBOT_NOT_READY);
    EXPECT_NE(outcome.text.find("come to rest"), std::string::npos) << outcome.text;
  }
  end_stops();
}

/// The call sees no snapshot of the Error, as one that waits for its turn or plans.
TEST_F(StopOrder, WhatBeganBeforeAnErrorDoesNotMoveTheArmAfterItsClear) {
  begin_stop();
  std::atomic<bool> is_waiting{false}, goes_on{false};
  Outcome outcome{};
  std::thread call([&] {
    const auto wanted = [&] {
      is_waiting = true;
      EXPECT_TRUE(wait_until(within(30), [&] { return goes_on.load(); }));
    };
    outcome.status = status_of([&] { outcome.ticket = robot_->accept(DwellRequest{1.0}, 0, {}, wanted); });
  });
  ASSERT_TRUE(wait_until(within(30), [&] { return is_waiting.load(); }));
  task_.fail(alarm::loop_gap(100'000'000));
  std::thread clear([&] { EXPECT_EQ(status_of([&] { robot_->clear(); }), CORBOT_OK); });
  ASSERT_TRUE(wait_until(within(30), [&] { return task_.servant().control.clear_count.load() == 1; }));
  task_.change([](Snapshot& now) { now.state = RtState::kStandby, now.clears_done = 1; });
  end_stops();
  clear.join();
  goes_on = true;
  call.join();
  EXPECT_EQ(outcome.status, CORBOT_NOT_READY);
  EXPECT_EQ(task_.queued(), 0u) << "handed over after the Clear";
  EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_OK);
}

/// One by the stop segment, of another process.
TEST_F(StopOrder, WhatIsPlannedAfterAStopOfAnotherProcessHasItsNumber) {
  const Outcome before = try_accept(DwellRequest{1.0});
  ASSERT_EQ(before.status, CORBOT_OK) << before.text;
  task_.change([](Snapshot& now) { now.stops_done = 1; });
  task_.complete(Verdict::kStopped);
  const Outcome later = try_accept(DwellRequest{1.0});
  EXPECT_EQ(later.status, CORBOT_OK) << later.text;
  EXPECT_EQ(task_.epoch_of_next(), 1u);
}

TEST_F(StopOrder, StopLeavesAPauseInForce) {
  ASSERT_EQ(status_of([&] { robot_->pause(true); }), CORBOT_OK);
  std::thread stop([&] { EXPECT_EQ(status_of([&] { robot_->stop(); }), CORBOT_OK); });
  ASSERT_TRUE(wait_until(within(30), [&] { return task_.stop_count() == 1; }));
  end_stops();
  stop.join();
  EXPECT_EQ(task_.servant().control.pause.load(), 1u) << "somebody else's Pause, perhaps";
}

/// An earlier servant's motion is named at once, with the time that it needs.
TEST_F(StopOrder, AnEarlierServantsMotionIsNotWaitedFor) {
  robot_.reset();
  task_.change([](Snapshot& now) {
    now.state = RtState::kMoving;
    now.command_id = 7;
    now.last_done_id = 6;
    now.command_duration_s = 9.0;
    now.virtual_time_s = 3.0;
    now.override_ratio = 0.5;
  });
  open_robot();
  const Outcome refused = try_accept(DwellRequest{1.0});
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_NE(refused.text.find("motion 7 is still under way, 12.0 s to go"), std::string::npos)
      << refused.text;
  task_.change([](Snapshot& now) {
    now.state = RtState::kStandby;
    now.command_id = 0;
    now.last_done_id = 7;
  });
  const Outcome accepted = try_accept(DwellRequest{1.0});
  EXPECT_EQ(accepted.status, CORBOT_OK) << accepted.text;
  EXPECT_EQ(accepted.ticket, 8u);
}

}  // namespace
}  // namespace corbot::test::stop_order_test
