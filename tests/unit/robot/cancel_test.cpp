// SPDX-License-Identifier: Apache-2.0
// Cancel takes back one motion and what is queued behind it; what is before it goes on.
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "robot/task_fixture.h"

namespace corbot::test::cancel_test {
namespace {

class Cancel : public TaskTest {
 protected:
  void SetUp() override { open_robot(); }
  void TearDown() override { robot_.reset(); }

  corbot_ticket drive(double angle_rad) {
    const Outcome outcome = try_accept(DriveRequest{0, angle_rad, 0.5});
    EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
    return outcome.ticket;
  }
  corbot_motion_info end_of(corbot_ticket ticket) { return robot_->wait(ticket, 30.0); }
  double joint_q() { return robot_->view().snapshot().position_q[0]; }
  bool runs(corbot_ticket ticket) { return robot_->wait(ticket, 0.0).progress > 0.1; }

  LoopTask task_{name_, profile_.arm};
};

TEST_F(Cancel, AQueuedMotionAndThoseBehindItNeverBegin) {
  const corbot_ticket first = drive(0.3);
  const corbot_ticket second = drive(0.3);
  const corbot_ticket third = drive(0.3);
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->wait(first, 0.0).progress > 0.0; }));
  robot_->pause(true);  // so that all of this is while the first is under way
  robot_->cancel(second);
  for (const corbot_ticket ticket : {second, third}) {
    EXPECT_EQ(robot_->wait(ticket, 0.0).state, CORBOT_MOTION_STOPPED) << "when Cancel has returned";
    EXPECT_STREQ(robot_->wait(ticket, 0.0).reason, "taken back by Cancel");
  }
  // The next is planned from where the first will rest.
  const corbot_ticket next = drive(-0.1);
  robot_->pause(false);
  EXPECT_EQ(end_of(first).state, CORBOT_MOTION_DONE);
  const corbot_motion_info info = end_of(next);
  EXPECT_EQ(info.state, CORBOT_MOTION_DONE) << info.reason;
  EXPECT_NEAR(joint_q(), 0.2, 1e-6);
}

TEST_F(Cancel, ThatIsNotWaitedForIsCarriedOutAllTheSame) {
  const corbot_ticket first = drive(0.3);
  const corbot_ticket second = drive(0.3);
  const corbot_ticket third = drive(0.3);
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->wait(first, 0.0).progress > 0.0; }));
  robot_->pause(true);
  const auto at_once = [] { throw not_ready("enough"); };
  EXPECT_EQ(status_of([&] { robot_->cancel(second, at_once); }), CORBOT_NOT_READY);
  for (const corbot_ticket ticket : {second, third})
    EXPECT_EQ(end_of(ticket).state, CORBOT_MOTION_STOPPED) << "before the first has ended";
  EXPECT_TRUE(robot_->view().paused());
  const corbot_ticket next = drive(-0.1);
  robot_->pause(false);
  EXPECT_EQ(end_of(first).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(end_of(next).state, CORBOT_MOTION_DONE);
  EXPECT_NEAR(joint_q(), 0.2, 1e-6);
}

TEST_F(Cancel, ARunningMotionSlowsDownOnItsPath) {
  const corbot_ticket first = drive(1.0);
  const corbot_ticket second = drive(0.1);
  ASSERT_TRUE(wait_until(within(30), [&] { return runs(first); }));
  robot_->cancel(first);
  EXPECT_EQ(robot_->wait(first, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(robot_->wait(second, 0.0).state, CORBOT_MOTION_STOPPED);
  const double rest_q = joint_q();
  EXPECT_GT(rest_q, 0.0);
  EXPECT_LT(rest_q, 1.0);
  const corbot_motion_info info = end_of(drive(0.1));
  EXPECT_EQ(info.state, CORBOT_MOTION_DONE) << info.reason;
  EXPECT_NEAR(joint_q(), rest_q + 0.1, 1e-6);
}

TEST_F(Cancel, WhilePaused) {
  const corbot_ticket first = drive(1.0);
  const corbot_ticket second = drive(0.1);
  ASSERT_TRUE(wait_until(within(30), [&] { return runs(first); }));
  robot_->pause(true);
  robot_->cancel(first);
  EXPECT_EQ(robot_->wait(first, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(robot_->wait(second, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_TRUE(robot_->view().paused()) << "a Cancel is no Resume";
  robot_->pause(false);
}

TEST_F(Cancel, OfAnEndedMotionHasNoEffectAndOfNoneIsRefused) {
  const corbot_ticket first = drive(0.05);
  ASSERT_EQ(end_of(first).state, CORBOT_MOTION_DONE);
  const corbot_ticket second = drive(0.05);
  EXPECT_EQ(status_of([&] { robot_->cancel(first); }), CORBOT_OK);
  EXPECT_EQ(status_of([&] { robot_->cancel(second + 100); }), CORBOT_BAD_PARAMETER);
  EXPECT_EQ(end_of(first).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(end_of(second).state, CORBOT_MOTION_DONE);
}

/// Both commands of one motion are its own.
TEST_F(Cancel, ALineAndTheArcBehindItAreOneMotion) {
  const Outcome ready = try_accept(MoveRequest{{0.20, 0.0, 0.10}, 0.0});
  ASSERT_EQ(end_of(ready.ticket).state, CORBOT_MOTION_DONE);
  const Outcome arc = try_accept(MoveCRequest{{0.20, -0.03, 0.10}, {0.22, 0.0, 0.10}, {0.20, 0.03, 0.10}});
  ASSERT_EQ(arc.status, CORBOT_OK) << arc.text;
  robot_->cancel(arc.ticket);
  EXPECT_EQ(robot_->wait(arc.ticket, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(end_of(drive(0.05)).state, CORBOT_MOTION_DONE);
}

/// From several threads, with motions coming all the time: each ends once, nothing is refused by the task.
TEST_F(Cancel, AmongManyClientsEveryMotionEndsAsItsClientHears) {
  std::vector<std::thread> clients;
  std::atomic<int> done{0};
  std::atomic<int> stopped{0};
  for (int i = 0; i < 6; ++i) {
    clients.emplace_back([&, i] {
      for (int n = 0; n < 9; ++n) {
        const Outcome outcome = try_accept(DriveRequest{i % 2, (n % 2 == 0 ? 1.0 : -1.0) * 0.02, 0.5});
        ASSERT_EQ(outcome.status, CORBOT_OK) << outcome.text;
        if (n % 3 == 0) {
          ASSERT_EQ(status_of([&] { robot_->cancel(outcome.ticket); }), CORBOT_OK);
        }
        const corbot_motion_info info = robot_->wait(outcome.ticket, 60.0);
        ASSERT_TRUE(info.state == CORBOT_MOTION_DONE || info.state == CORBOT_MOTION_STOPPED)
            << info.state << ' ' << info.reason;
        ++(info.state == CORBOT_MOTION_DONE ? done : stopped);
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_GT(done, 0);
  EXPECT_GT(stopped, 0);
  for (const AlarmEntry& alarm : robot_->view().alarms())
    EXPECT_NE(alarm.code, static_cast<std::int32_t>(AlarmCode::kCommandRefused)) << alarm.text;
}

/// A line that was planned from the end of a motion that is taken back meanwhile would begin where the arm
/// does not stand.
TEST_F(Cancel, WhileOthersPlan) {
  robot_->finish(try_accept(ReadyRequest{}).ticket);
  constexpr std::size_t kCancels = 100;
  std::mutex mutex;  // of the tickets
  std::vector<corbot_ticket> tickets;
  std::atomic<bool> over{false};
  std::thread starts([&] {
    for (double way_m = 1e-3; !over; way_m = -way_m) {
      const Outcome outcome = try_accept(MoveRelativeRequest{{{0.0, 0.0, way_m}, {}}, {}, 0.0, true});
      const std::lock_guard lock(mutex);
      if (outcome.status == CORBOT_OK) tickets.push_back(outcome.ticket);
    }
  });
  const auto next = [&](std::size_t known) {
    const std::lock_guard lock(mutex);
    return tickets.size() > known ? std::optional(tickets.back()) : std::nullopt;
  };
  for (std::size_t i = 0, known = 0; i < kCancels; ++i) {
    std::optional<corbot_ticket> last;
    EXPECT_TRUE(wait_until(within(30), [&] { return (last = next(known)).has_value(); }));
    robot_->cancel(last.value_or(0));
    const std::lock_guard lock(mutex);
    known = tickets.size();
  }
  over = true;
  starts.join();
  for (const corbot_ticket ticket : tickets) {
    const corbot_motion_info info = robot_->wait(ticket, 30.0);
    ASSERT_TRUE(info.state == CORBOT_MOTION_DONE || info.state == CORBOT_MOTION_STOPPED)
        << info.reason << ", motion " << ticket << " of " << tickets.size();
  }
}

}  // namespace
}  // namespace corbot::test::cancel_test
