// SPDX-License-Identifier: Apache-2.0
// StopAndHold where the calls come in: returns at rest, says who asked, outlives servant and task, ends with
// Clear.
#include <gtest/gtest.h>

#include "robot/alarm_log.h"
#include "robot/called_robot.h"

namespace corbot::test::hold_calls_test {
namespace {

constexpr int32_t kHeldAlarm = 133;

class HoldCalls : public CalledRobot {
 protected:
  corbot_status hold() {
    const corbot_caller anyone = caller(public_);
    return corbot_robot_stop_and_hold(called_.get(), &anyone, &error_);
  }
  corbot_status clear() { return corbot_robot_clear(called_.get(), nullptr, &error_); }
  [[nodiscard]] bool is_held() const { return corbot_robot_held(called_.get()) != 0; }
  void restart_task() {
    const std::size_t losses = alarms_of(kAlarmTaskGone);
    const std::size_t starts = alarms_of(kAlarmTaskRestarted);
    if (task_) {
      task_.reset();
      ASSERT_TRUE(wait_until(within(30), [&] { return alarms_of(kAlarmTaskGone) > losses; }));
    }
    task_ = std::make_unique<LoopTask>(name_, profile_.arm);
    ASSERT_TRUE(wait_until(within(30), [&] { return alarms_of(kAlarmTaskRestarted) > starts; }));
  }
  /// A robot that is held refuses motions; one whose task is only starting does, too, with another reason.
  bool refuses_as_held() {
    return wait_until(within(30), [&] {
      return drive(public_, 1.0) == CORBOT_NOT_READY &&
             std::string(error_.text).find("StopAndHold") != std::string::npos;
    });
  }
};

TEST_F(HoldCalls, ReturnsAtRestInErrorAndSaysWhoAsked) {
  open_at_rest();
  EXPECT_FALSE(is_held());
  ASSERT_EQ(drive(public_, 60.0, 5.0), CORBOT_OK) << error_.text;
  ASSERT_TRUE(wait_until(within(30), [&] { return joint_0_deg() > 2.0; }));
  ASSERT_EQ(hold(), CORBOT_OK) << error_.text;
  const double rest_deg = joint_0_deg();
  EXPECT_EQ(corbot_robot_state(called_.get()), CORBOT_STATE_ERROR);
  EXPECT_TRUE(is_held());
  EXPECT_EQ(end_of(ticket_).state, CORBOT_MOTION_STOPPED);
  EXPECT_TRUE(wait_until(within(30), [&] { return is_alarm_active(kHeldAlarm, "127.0.0.1:40000"); }));
  EXPECT_TRUE(refuses_as_held()) << error_.text;
  EXPECT_NE(std::string(error_.text).find("127.0.0.1:40000"), std::string::npos) << error_.text;
  EXPECT_EQ(joint_0_deg(), rest_deg);
  ASSERT_EQ(clear(), CORBOT_OK) << error_.text;
  EXPECT_FALSE(is_held());
  EXPECT_FALSE(is_alarm_active(kHeldAlarm, ""));
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
  EXPECT_EQ(end_of(ticket_).state, CORBOT_MOTION_DONE);
}

TEST_F(HoldCalls, IsNotEndedByAClearThatArrivedBefore) {
  open_at_rest();
  corbot_caller anyone = caller(public_);
  std::uint64_t by_others = 0;
  corbot_robot_stops(called_.get(), &anyone.stops, &by_others);
  EXPECT_NE(anyone.stops, 0u) << "before the first stop, too";
  ASSERT_EQ(hold(), CORBOT_OK) << error_.text;
  EXPECT_EQ(corbot_robot_clear(called_.get(), &anyone, &error_), CORBOT_NOT_READY);
  EXPECT_NE(std::string(error_.text).find("a stop came after this Clear"), std::string::npos) << error_.text;
  EXPECT_TRUE(is_held());
  corbot_robot_stops(called_.get(), &anyone.stops, &by_others);
  EXPECT_EQ(corbot_robot_clear(called_.get(), &anyone, &error_), CORBOT_OK) << error_.text;
  EXPECT_FALSE(is_held());
}

TEST_F(HoldCalls, OutlivesTheServant) {
  open_at_rest();
  ASSERT_EQ(hold(), CORBOT_OK) << error_.text;
  restart_servant();
  EXPECT_TRUE(is_held());
  EXPECT_EQ(drive(public_, 1.0), CORBOT_NOT_READY);
  ASSERT_EQ(clear(), CORBOT_OK) << error_.text;
  restart_servant();
  EXPECT_FALSE(is_held());
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
}

/// The new task has nothing of the one before: only the servant knows.
TEST_F(HoldCalls, OutlivesTheTask) {
  open_at_rest();
  ASSERT_EQ(hold(), CORBOT_OK) << error_.text;
  restart_task();
  EXPECT_TRUE(refuses_as_held()) << error_.text;
  ASSERT_EQ(clear(), CORBOT_OK) << error_.text;
  restart_task();
  ASSERT_TRUE(until_state(CORBOT_STATE_STANDBY)) << "what was cleared does not come back";
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
}

TEST_F(HoldCalls, WithoutATaskTheNextOneIsHeld) {
  open_at_rest();
  task_.reset();
  ASSERT_TRUE(until_state(CORBOT_STATE_ERROR));
  EXPECT_EQ(hold(), CORBOT_NOT_READY) << "nobody knows yet that the arm is at rest";
  EXPECT_TRUE(is_held());
  restart_task();
  EXPECT_TRUE(refuses_as_held()) << error_.text;
  ASSERT_EQ(clear(), CORBOT_OK) << error_.text;
  EXPECT_TRUE(until_state(CORBOT_STATE_STANDBY));
}

/// Its task froze, say: the Clear is carried out all the same, and the servant finds that out.
TEST_F(TaskTest, AClearThatNobodyWaitedForIsSeen) {
  FakeTask task(name_, profile_.arm);
  task.run();
  open_robot();
  const std::uint64_t stops = task.stop_count();
  std::thread caller([&] { EXPECT_EQ(status_of([&] { robot_->stop_and_hold("a person"); }), CORBOT_OK); });
  // The hold is counted first, and then the Stop.
  ASSERT_TRUE(wait_until(within(30), [&] { return task.stop_count() == stops + 1; }));
  EXPECT_EQ(task.servant().control.hold_count.load(), 1u);
  EXPECT_TRUE(robot_->view().held()) << "from the request on";
  ASSERT_TRUE(wait_until(within(30), [&] {
    task.change([&](Snapshot& now) {
      now.stops_done = task.stop_count();
      now.holds_done = 1;
      now.flags = kSnapshotHeld;
      now.state = RtState::kError;
    });
    return robot_->view().state() == CORBOT_STATE_ERROR;
  }));
  caller.join();
  EXPECT_TRUE(robot_->view().held());
  task.change([](Snapshot& now) {
    now.flags = 0;
    now.state = RtState::kStandby;
  });
  EXPECT_TRUE(wait_until(
      within(30), [&] { return !robot_->view().held() && task.servant().control.holds_cleared == 1; }));
  EXPECT_EQ(status_of([&] { robot_->clear(); }), CORBOT_OK);
  robot_.reset();
}

/// Its hold is counted before anybody looks who has asked for it: the alarm gets the name when the call has
/// said it.
TEST_F(TaskTest, AHoldThatWasCountedOnArrivalHasItsNameInTheAlarm) {
  FakeTask task(name_, profile_.arm);
  task.run();
  open_robot();
  const auto held_text = [&] {
    std::string text;
    for (const AlarmEntry& alarm : robot_->view().alarms()) {
      if (alarm.code == static_cast<std::int32_t>(AlarmCode::kHeld)) text = alarm.text;
    }
    return text;
  };
  const corbot_counted_stop counted = robot_->count_stop(true);
  EXPECT_EQ(task.servant().control.hold_count.load(), 1u);
  EXPECT_EQ(task.stop_count(), 1u);
  AlarmEvent held{};
  held.code = AlarmCode::kHeld;
  task.fail(held);
  ASSERT_TRUE(wait_until(within(30), [&] { return !held_text().empty(); }));
  EXPECT_EQ(held_text().find("asked for by"), std::string::npos) << held_text();
  task.change([&](Snapshot& now) {
    now.stops_done = task.stop_count();
    now.holds_done = 1;
    now.flags = kSnapshotHeld;
    now.state = RtState::kError;
  });
  EXPECT_EQ(status_of([&] { robot_->stop_and_hold("a person", counted); }), CORBOT_OK);
  EXPECT_NE(held_text().find("asked for by a person"), std::string::npos) << held_text();
  EXPECT_EQ(task.servant().control.hold_count.load(), 1u) << "once";
  EXPECT_EQ(task.stop_count(), 1u) << "once";
  robot_.reset();
}

TEST_F(HoldCalls, HoldAndClearOfManyAtOnceEndInWhatTheLastOneSays) {
  open_at_rest();
  for (int round = 0; round < 20; ++round) {
    std::vector<std::thread> clients;
    for (int i = 0; i < 4; ++i) {
      clients.emplace_back([&, holds = i % 2 == 0] {
        corbot_error error{};
        if (holds) {
          EXPECT_EQ(corbot_robot_stop_and_hold(called_.get(), nullptr, &error), CORBOT_OK) << error.text;
        } else {
          (void)corbot_robot_clear(called_.get(), nullptr, &error);
        }
      });
    }
    for (std::thread& client : clients) client.join();
    EXPECT_EQ(is_held(), corbot_robot_state(called_.get()) == CORBOT_STATE_ERROR);
    ASSERT_EQ(hold(), CORBOT_OK) << error_.text;
    ASSERT_TRUE(is_held());
    ASSERT_EQ(clear(), CORBOT_OK) << error_.text;
    ASSERT_FALSE(is_held());
    ASSERT_EQ(corbot_robot_state(called_.get()), CORBOT_STATE_STANDBY);
  }
}

}  // namespace
}  // namespace corbot::test::hold_calls_test
