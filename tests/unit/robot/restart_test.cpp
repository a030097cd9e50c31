// SPDX-License-Identifier: Apache-2.0
// Every accepted motion ends once, and its caller gets the outcome, whatever happens to the real-time task.
#include "robot/task_fixture.h"
#include "support/cases.h"

namespace corbot::test::restart_test {
namespace {

class Restart : public TaskTest {
 protected:
  void SetUp() override {
    task_.run();
    open_robot();
  }
  void TearDown() override { robot_.reset(); }

  corbot_ticket accept() {
    const Outcome outcome = try_accept(DwellRequest{1.0});
    EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
    return outcome.ticket;
  }
  corbot_motion_info end_of(corbot_ticket ticket) { return robot_->wait(ticket, 30.0); }

  FakeTask task_{name_, profile_.arm};
};

/// The work that a task had done before it died counts, although no call can reach that task.
TEST_F(Restart, AStopThatADeadTaskHadCarriedOutIsDone) {
  for (const bool is_done : {true, false}) {
    corbot_status status = CORBOT_INTERNAL;
    std::string text;
    const std::uint64_t count = task_.stop_count();
    std::thread stop([&] {
      try {
        robot_->stop();
        status = CORBOT_OK;
      } catch (const CallError& refused) {
        status = refused.error.status;
        text = refused.error.text;
      }
    });
    ASSERT_TRUE(wait_until(within(30), [&] { return task_.stop_count() > count; }));
    if (is_done) task_.change([&](Snapshot& now) { now.stops_done = task_.stop_count(); });
    task_.die();
    stop.join();
    EXPECT_EQ(status, is_done ? CORBOT_OK : CORBOT_NOT_READY);
    EXPECT_EQ(text.find("is gone") != std::string::npos, !is_done) << text;
    task_.adopt();
    task_.run();
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  }
}

TEST_F(Restart, ATaskWhoseCycleDoesNotRunYetIsNotReady) {
  const corbot_ticket lost = accept();
  task_.die();
  task_.adopt();
  const corbot_motion_info info = end_of(lost);
  EXPECT_EQ(info.state, CORBOT_MOTION_FAILED);
  EXPECT_NE(std::string(info.reason).find("is gone"), std::string::npos) << info.reason;
  // It listens, with a new incarnation, and approaches its device.
  const Deadline approached = within(0.3);
  wait_until(approached, [&] {
    EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_NOT_READY);
    EXPECT_EQ(robot_->view().state(), CORBOT_STATE_ERROR);
    return HasFailure();
  });
  task_.run();
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  const corbot_ticket next = accept();
  task_.complete(Verdict::kDone);
  EXPECT_EQ(end_of(next).state, CORBOT_MOTION_DONE);
}

TEST_F(Restart, ALostVerdictEndsItsMotionAsFailed) {
  const corbot_ticket first = accept();
  const corbot_ticket second = accept();
  task_.lose_verdict();
  const corbot_motion_info info = end_of(first);
  EXPECT_EQ(info.state, CORBOT_MOTION_FAILED);
  EXPECT_NE(std::string(info.reason).find("record"), std::string::npos) << info.reason;
  EXPECT_EQ(robot_->wait(second, 0.0).state, CORBOT_MOTION_QUEUED) << "it has not ended";
  task_.complete(Verdict::kDone);
  EXPECT_EQ(end_of(second).state, CORBOT_MOTION_DONE);
}

TEST_F(Restart, AVerdictThatIsOutBeforeTheSnapshotIsNeverTakenForLost) {
  for (int i = 0; i < 300; ++i) {
    const corbot_ticket ticket = accept();
    task_.complete(Verdict::kDone);
    ASSERT_EQ(end_of(ticket).state, CORBOT_MOTION_DONE) << i;
  }
}

TEST_F(Restart, SeveralRestartsAtOnceLeaveNothingPending) {
  std::vector<corbot_ticket> tickets;
  for (int i = 0; i < 5; ++i) tickets.push_back(accept());
  for (int i = 0; i < 3; ++i) {
    task_.die();
    task_.adopt();
  }
  task_.run();
  for (const corbot_ticket ticket : tickets) EXPECT_EQ(end_of(ticket).state, CORBOT_MOTION_FAILED);
}

/// A number that was given away and never pushed ends nothing, and no call waits for it.
TEST_F(Restart, AServantThatDiedBetweenTicketAndPushHoldsUpNobody) {
  robot_.reset();
  {
    ServantPort dead(name_, fingerprint(profile_.arm), nullptr);
    const auto channel = dead.connect([] { return false; });
    ASSERT_TRUE(wait_until(within(30), [&] { return channel->is_served(); }));
    channel->own().next_command_id.fetch_add(2);
  }
  open_robot();
  EXPECT_EQ(accept(), 3u);
}

/// The real cycle, again and again: some of these motions are pushed while one task ends and the next adopts.
TEST_F(TaskTest, EveryMotionEndsAcrossRestartsOfTheRealCycle) {
  auto task = std::make_unique<LoopTask>(name_, profile_.arm);
  open_robot();
  std::atomic<bool> end{false};
  std::atomic<int> accepted{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&, sign = i % 2 == 0 ? 1.0 : -1.0] {
      while (!end) {
        const Outcome outcome = try_accept(DriveRequest{0, 0.01 * sign, 0.2});
        if (outcome.status != CORBOT_OK) continue;
        ++accepted;
        const auto state = robot_->wait(outcome.ticket, 30.0).state;
        EXPECT_NE(state, CORBOT_MOTION_QUEUED) << outcome.ticket;
        EXPECT_NE(state, CORBOT_MOTION_RUNNING) << outcome.ticket;
      }
    });
  }
  for (int restart = 0, restarts = cases(100); restart < restarts; ++restart) {
    const int before = accepted;
    EXPECT_TRUE(wait_until(within(30), [&] { return accepted >= before + 5; })) << "restart " << restart;
    task.reset();
    task = std::make_unique<LoopTask>(name_, profile_.arm);
  }
  end = true;
  for (std::thread& client : clients) client.join();
  robot_.reset();
}

/// The task reads the newest request only.
TEST_F(Restart, ACancelThatIsNotWaitedForIsPartOfTheNextOne) {
  std::array<corbot_ticket, 4> tickets{};
  for (corbot_ticket& ticket : tickets) ticket = accept();
  task_.begin();
  const auto at_once = [] { throw not_ready("the caller is gone"); };
  EXPECT_EQ(status_of([&] { robot_->cancel(tickets[1], at_once); }), CORBOT_NOT_READY);
  EXPECT_EQ(status_of([&] { robot_->cancel(tickets[3], at_once); }), CORBOT_NOT_READY);
  CancelRequest request{};
  ASSERT_TRUE(task_.servant().control.cancel.load(request));
  EXPECT_EQ(request.count, 2u);
  EXPECT_LE(request.first, tickets[1]);
  EXPECT_GE(request.last, tickets[3]);
}

TEST_F(Restart, WithoutATaskTheTicketsOfTheFormerServantAreNotSaidToBeUnknown) {
  const corbot_ticket done = accept();
  task_.complete(Verdict::kDone);
  ASSERT_EQ(end_of(done).state, CORBOT_MOTION_DONE);
  robot_.reset();
  task_.die();
  robot_ = std::make_unique<Robot>(profile_, name_);
  EXPECT_EQ(status_of([&] { (void)robot_->wait(done, 0.0); }), CORBOT_NO_DATA);
  EXPECT_EQ(status_of([&] { robot_->cancel(done); }), CORBOT_NOT_READY);
  task_.adopt();
  task_.run();
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  EXPECT_EQ(status_of([&] { (void)robot_->wait(done + 1, 0.0); }), CORBOT_BAD_PARAMETER)
      << "once there is a task";
}

}  // namespace
}  // namespace corbot::test::restart_test
