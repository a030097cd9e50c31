// SPDX-License-Identifier: Apache-2.0
// Tests the state that a servant leaves in its segment, and its use by the next servant: also of bytes that
// no servant writes.
#include <cmath>
#include <limits>

#include "corbot/channel/alarms.h"
#include "robot/inherited_state.h"
#include "robot/task_fixture.h"

namespace corbot {

/// Lets a test leave a record as a servant does that is killed while it stores it.
struct DurableCellParts {
  template <class Record>
  static void tear_last(DurableCell<Record>& cell) {
    tear(cell.cells_[cell.stores_.load() & 1]);
  }
  template <class Record>
  static void tear_both(DurableCell<Record>& cell) {
    tear(cell.cells_[0]);
    tear(cell.cells_[1]);
  }

 private:
  /// The sequence is the first word of a cell.
  template <class Cell>
  static void tear(Cell& cell) {
    std::uint64_t sequence{};
    std::memcpy(&sequence, static_cast<void*>(&cell), sizeof(sequence));
    sequence |= 1;
    std::memcpy(static_cast<void*>(&cell), &sequence, sizeof(sequence));
  }
};

namespace test {
namespace {

const SettingsRecord kSettings{0.5, {0.25, 0.5, 0.75, 1.0, 1.0, 1.0}, std::uint64_t{1}, -0.5, {}, 0, {},
                               {}};  // kPitch

TicketRecord pending_ticket(std::uint64_t id, std::uint64_t incarnation) {
  TicketRecord record{};
  record.first = id;
  record.last = id;
  record.duration_s = 1.0;
  record.incarnation = incarnation;
  record.state = TicketState::kPending;
  return record;
}

class Inherit : public TaskTest {
 protected:
  void SetUp() override { task_.run(); }
  void TearDown() override { robot_.reset(); }

  /// A servant that leaves what `forge` writes, and is gone.
  template <class Forge>
  void leave(Forge&& forge) {
    ServantPort former(name_, fingerprint(profile_.arm), nullptr);
    const auto channel = former.connect([] { return false; });
    ASSERT_TRUE(wait_until(within(30), [&] { return channel->is_served(); }));
    forge(channel->own());
    channel->disconnect();
  }
  [[nodiscard]] TicketRecord pending(std::uint64_t id) {
    return pending_ticket(id, task_.task().incarnation);
  }
  void restart() {
    robot_.reset();
    open_robot();
  }
  corbot_ticket accept(double t_s) {
    const Outcome outcome = try_accept(DwellRequest{t_s});
    EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
    return outcome.ticket;
  }
  double planned_s() {
    const Outcome outcome = try_accept(MoveJointsRequest{{0.5, 0.5, 0.5, 0.5}, 0.0});
    EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
    const double duration_s = robot_->wait(outcome.ticket, 0.0).duration_s;
    task_.complete(Verdict::kDone);
    EXPECT_EQ(robot_->wait(outcome.ticket, 30.0).state, CORBOT_MOTION_DONE);
    return duration_s;
  }
  [[nodiscard]] bool has_alarm(std::int32_t code) const {
    const auto alarms = robot_->view().alarms();
    return std::any_of(alarms.begin(), alarms.end(), [&](const auto& entry) { return entry.code == code; });
  }

  FakeTask task_{name_, profile_.arm};
};

TEST_F(Inherit, SpeedsAndToolPitchOutliveAServant) {
  open_robot();
  const double fastest_s = planned_s();
  robot_->set_speed(50.0);
  robot_->set_all_speeds(80.0);
  robot_->set_joint_speed(1, 20.0);
  robot_->set_tool_pitch(-30.0);
  const double slow_s = planned_s();
  ASSERT_GT(slow_s, 2.0 * fastest_s);
  for (int restart = 0; restart < 3; ++restart) {
    robot_.reset();
    open_robot();
    EXPECT_EQ(robot_->tool_pitch_deg(), -30.0);
    EXPECT_EQ(planned_s(), slow_s);
    EXPECT_FALSE(has_alarm(kAlarmFormerServantInvalid));
  }
}

TEST_F(Inherit, WhatWasSetBeforeTheTaskWasThereIsNewer) {
  leave([](ServantSegment& own) { own.state.settings.store(kSettings); });
  task_.die();
  robot_ = std::make_unique<Robot>(profile_, name_);
  robot_->set_tool_pitch(20.0);
  task_.adopt();
  task_.run();
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  EXPECT_EQ(robot_->tool_pitch_deg(), 20.0);
}

TEST_F(Inherit, AServantThatWasKilledWhileItStoredLeavesTheRecordBefore) {
  leave([](ServantSegment& own) {
    own.state.settings.store(kSettings);
    SettingsRecord torn = kSettings;
    torn.tool_pitch_rad = 0.75;
    own.state.settings.store(torn);
    DurableCellParts::tear_last(own.state.settings);
  });
  open_robot();
  EXPECT_NEAR(robot_->tool_pitch_deg(), -0.5 * 180.0 / M_PI, 1e-6);
  EXPECT_FALSE(has_alarm(kAlarmFormerServantInvalid));
}

TEST_F(Inherit, AFirstRecordThatWasNeverWholeIsNone) {
  leave([](ServantSegment& own) {
    own.state.settings.store(kSettings);
    DurableCellParts::tear_last(own.state.settings);
  });
  open_robot();
  EXPECT_EQ(robot_->tool_pitch_deg(), 0.0);
  EXPECT_FALSE(has_alarm(kAlarmFormerServantInvalid));
}

TEST_F(Inherit, SettingsThatNoServantStoresAreLeftOutAndReported) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<SettingsRecord> forged(10, kSettings);
  forged[0].speed_ratio = 0.0;
  forged[1].speed_ratio = kNan;
  forged[2].speed_ratio = 1.0 + 1e-12;
  forged[3].joint_speed_ratio[5] = -0.5;
  forged[4].joint_speed_ratio[0] = kInfinity;
  forged[5].tool_pitch_rad = kNan;
  forged[6].tool_pitch_rad = 4.0;
  forged[8].tool_is_set = 3;
  forged[9].tool_orientation = {0.0, 0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < forged.size(); ++i) {
    leave([&](ServantSegment& own) {
      own.state.settings.store(forged[i]);
      if (i == 7) {
        own.state.settings.store(forged[i]);
        DurableCellParts::tear_both(own.state.settings);
      }
    });
    open_robot();
    EXPECT_EQ(robot_->tool_pitch_deg(), 0.0) << i;
    EXPECT_TRUE(has_alarm(kAlarmFormerServantInvalid)) << i;
    robot_.reset();
  }
}

/// Its text is shown on terminals.
TEST_F(Inherit, ANameOfWhoHeldTheArmThatIsNotPrintableIsInvalid) {
  leave([&](ServantSegment& own) {
    HoldRecord record{};
    record.by = {'\x1b', '[', '2', 'J'};
    own.state.hold.store(record);
  });
  open_robot();
  EXPECT_TRUE(has_alarm(kAlarmFormerServantInvalid));
}

TEST_F(Inherit, MotionsThatRunOrWaitKeepTheirTickets) {
  open_robot();
  const corbot_ticket running = accept(2.0);
  const corbot_ticket queued = accept(3.0);
  const corbot_ticket last = accept(4.0);
  task_.begin();
  restart();
  EXPECT_EQ(robot_->view().state(), CORBOT_STATE_WAITING);
  EXPECT_EQ(robot_->wait(running, 0.0).state, CORBOT_MOTION_RUNNING);
  EXPECT_EQ(robot_->wait(queued, 0.0).state, CORBOT_MOTION_QUEUED);
  EXPECT_EQ(robot_->wait(queued, 0.0).duration_s, 3.0);
  const corbot_ticket own = accept(5.0);
  EXPECT_EQ(own, last + 1);
  restart();
  task_.complete(Verdict::kDone);
  EXPECT_EQ(robot_->wait(running, 30.0).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(robot_->wait(queued, 0.0).state, CORBOT_MOTION_QUEUED);
  task_.complete(Verdict::kDone);
  restart();
  EXPECT_EQ(robot_->wait(queued, 30.0).state, CORBOT_MOTION_DONE);
  task_.complete(Verdict::kLimit);
  EXPECT_EQ(robot_->wait(last, 30.0).state, CORBOT_MOTION_FAILED);
  EXPECT_NE(std::string(robot_->wait(last, 0.0).reason).find("limit"), std::string::npos);
  task_.complete(Verdict::kDone);
  EXPECT_EQ(robot_->wait(own, 30.0).state, CORBOT_MOTION_DONE);
  restart();
  EXPECT_EQ(robot_->wait(running, 0.0).state, CORBOT_MOTION_DONE);
  EXPECT_NE(std::string(robot_->wait(last, 0.0).reason).find("limit"), std::string::npos);
  EXPECT_EQ(robot_->view().state(), CORBOT_STATE_STANDBY);
  EXPECT_FALSE(has_alarm(kAlarmFormerServantInvalid));
}

TEST_F(Inherit, VerdictsThatCameWhileNoServantWasThereAreRead) {
  open_robot();
  const corbot_ticket done = accept(1.0);
  const corbot_ticket stopped = accept(1.0);
  robot_.reset();
  task_.complete(Verdict::kDone);
  task_.complete(Verdict::kStopped);
  open_robot();
  EXPECT_EQ(robot_->wait(done, 30.0).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(robot_->wait(stopped, 30.0).state, CORBOT_MOTION_STOPPED);
}

/// Killed after it had taken the verdict and the alarm from their rings, before it had recorded them.
TEST_F(Inherit, WhatTheFormerServantHadTakenAndNotRecordedIsReadAgain) {
  leave([&](ServantSegment& own) {
    own.next_command_id = 2;
    own.state.tickets[0].store(pending(1));
    task_.change([&](Snapshot& now) {
      ASSERT_TRUE(RingProducer(task_.task().completions, own.completions_tail)
                      .push({1, Verdict::kOrphaned, 0, now.cycle}));
      now.last_done_id = 1;
    });
    task_.fail(alarm::backend_lost(DeviceCause::kHungUp));
    Completion completion{};
    EXPECT_EQ(RingConsumer(task_.task().completions, own.completions_tail).pop(completion), PopResult::kOk);
    AlarmEvent event{};
    EXPECT_EQ(RingConsumer(task_.task().alarms, own.alarms_tail).pop(event), PopResult::kOk);
  });
  robot_ = std::make_unique<Robot>(profile_, name_);
  EXPECT_EQ(robot_->wait(1, 30.0).state, CORBOT_MOTION_FAILED);
  EXPECT_NE(std::string(robot_->wait(1, 0.0).reason).find("no servant"), std::string::npos);
  EXPECT_NE(robot_->view().error_cause().find("the line was cut"), std::string::npos);
}

TEST_F(Inherit, AMotionThatWasNeverHandedOverIsNoMotion) {
  leave([&](ServantSegment& own) {
    TicketRecord record = pending(1);
    record.handed_until = 1;
    own.state.tickets[0].store(record);
    own.next_command_id = 2;
  });
  task_.begin();  // of yet another servant
  open_robot();
  EXPECT_EQ(status_of([&] { (void)robot_->wait(1, 0.0); }), CORBOT_BAD_PARAMETER);
  EXPECT_FALSE(has_alarm(kAlarmFormerServantInvalid));
}

/// The task has no motion of this number that runs, waits or has a verdict. A call that waits for the number
/// must end.
TEST_F(Inherit, AMotionThatTheTaskDoesNotKnowEndsAsFailed) {
  leave([&](ServantSegment& own) {
    own.state.tickets[0].store(pending(100));
    own.next_command_id = 101;
  });
  open_robot();
  EXPECT_EQ(robot_->wait(100, 30.0).state, CORBOT_MOTION_FAILED);
  EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_OK);
}

/// A ticket with an unknown number holds up no call, even if it is marked as ended.
TEST_F(Inherit, ANumberThatTheTaskNeverHadHoldsUpNobody) {
  leave([&](ServantSegment& own) {
    TicketRecord record = pending(100);
    record.state = TicketState::kDone;
    own.state.tickets[0].store(record);
    own.next_command_id = 101;
  });
  task_.begin();  // what nobody has a ticket of
  open_robot();
  EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_NOT_READY);
  task_.change([](Snapshot& now) {
    now.command_id = 0;
    now.state = RtState::kStandby;
    now.last_done_id = 1;
  });
  const Outcome accepted = try_accept(DwellRequest{1.0});
  EXPECT_EQ(accepted.status, CORBOT_OK) << accepted.text;
}

TEST_F(Inherit, TheCauseOfAnErrorIsToldAsBefore) {
  open_robot();
  task_.fail(alarm::emergency_stop(1));
  task_.fail(alarm::backend_lost(DeviceCause::kHungUp));
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().alarms().size() == 2; }));
  const std::string cause = robot_->view().error_cause();
  const auto before = robot_->view().alarms();
  for (int i = 0; i < 3; ++i) {
    robot_.reset();
    robot_ = std::make_unique<Robot>(profile_, name_);
    EXPECT_EQ(robot_->view().error_cause(), cause);
    EXPECT_EQ(robot_->view().alarms(), before) << "restart " << i;
  }
  robot_.reset();
  task_.fail(alarm::loop_gap(2'000'000'000));
  robot_ = std::make_unique<Robot>(profile_, name_);
  EXPECT_EQ(robot_->view().alarms().size(), 3u);
  EXPECT_NE(robot_->view().error_cause(), cause);
}

/// The Clear was carried out, and its servant was killed before it had read that.
TEST_F(Inherit, NothingIsTheCauseOfAnErrorThatIsOver) {
  open_robot();
  task_.fail(alarm::emergency_stop(1));
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().alarms().size() == 1; }));
  robot_.reset();
  task_.change([](Snapshot& now) { now.state = RtState::kStandby; });
  open_robot();
  ASSERT_EQ(robot_->view().alarms().size(), 1u);
  EXPECT_FALSE(robot_->view().alarms()[0].active);
}

TEST_F(Inherit, ADeadTasksMotionsEndAsLost) {
  open_robot();
  const corbot_ticket lost = accept(1.0);
  robot_.reset();
  Descriptor kept = task_.kept_servant();
  ASSERT_TRUE(kept);
  task_.die();
  task_.adopt(std::move(kept));
  task_.run();
  open_robot();
  EXPECT_EQ(robot_->wait(lost, 30.0).state, CORBOT_MOTION_FAILED);
  EXPECT_EQ(try_accept(DwellRequest{1.0}).status, CORBOT_OK);
}

/// The real cycle. Cancel takes back what an earlier servant has queued, and only that.
TEST_F(TaskTest, AnEarlierServantsMotionCanBeTakenBack) {
  LoopTask task(name_, profile_.arm);
  open_robot();
  const corbot_ticket first = try_accept(DriveRequest{0, 0.4, 0.4}).ticket;
  const corbot_ticket second = try_accept(DriveRequest{0, -0.2, 0.2}).ticket;
  robot_.reset();
  open_robot();
  EXPECT_EQ(status_of([&] { robot_->cancel(second); }), CORBOT_OK);
  EXPECT_EQ(robot_->wait(second, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(robot_->wait(first, 0.0).state, CORBOT_MOTION_RUNNING);
  const Outcome third = try_accept(DriveRequest{0, 0.1, 0.4});
  ASSERT_EQ(third.status, CORBOT_OK) << third.text;
  robot_.reset();
  open_robot();
  EXPECT_EQ(robot_->wait(third.ticket, 30.0).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(robot_->wait(first, 0.0).state, CORBOT_MOTION_DONE);
  EXPECT_EQ(robot_->wait(second, 0.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_NE(std::string(robot_->wait(second, 0.0).reason).find("Cancel"), std::string::npos);
  Snapshot now{};
  ASSERT_TRUE(wait_until(within(10), [&] { return task.task().snapshot.load(now); }));
  EXPECT_NEAR(now.position_q[0], 0.5, 1e-6);
  robot_.reset();
}

/// Killed between its ticket's record and the task's look at the request.
TEST_F(TaskTest, ACancelOfAKilledServantIsRepeated) {
  LoopTask task(name_, profile_.arm);
  {
    ServantPort former(name_, fingerprint(profile_.arm), nullptr);
    const auto channel = former.connect([] { return false; });
    ASSERT_TRUE(wait_until(within(30), [&] { return channel->is_served(); }));
    ServantSegment& own = channel->own();
    const Planner planner(profile_.arm);
    const auto plan = [&](double from_q) {
      return std::get<std::vector<Command>>(planner.drive({{from_q}, 0.0}, {}, 0, 0.3, 0.3))[0];
    };
    Command commands[] = {plan(0.0), plan(0.3)};
    for (std::uint64_t i = 0; i < 2; ++i) {
      commands[i].id = i + 1;
      commands[i].epoch = channel->stops();
      commands[i].incarnation = static_cast<std::uint32_t>(task.task().incarnation);
      TicketRecord record = pending_ticket(i + 1, task.task().incarnation);
      record.end_q = commands[i].end_q;
      record.cancelled = i == 1 ? 1 : 0;
      own.state.tickets[i].store(record);
    }
    own.next_command_id = 3;
    ASSERT_TRUE(RingProducer(own.commands, task.task().commands_tail).push_all(commands, 2));
    channel->disconnect();
  }
  open_robot();
  EXPECT_EQ(robot_->wait(2, 30.0).state, CORBOT_MOTION_STOPPED);
  EXPECT_NE(std::string(robot_->wait(2, 0.0).reason).find("Cancel"), std::string::npos);
  EXPECT_EQ(robot_->wait(1, 30.0).state, CORBOT_MOTION_DONE);
  robot_.reset();
}

}  // namespace
}  // namespace test
}  // namespace corbot
