// SPDX-License-Identifier: Apache-2.0
// What a servant leaves in its segment, and what the next one makes of it: also of bytes that no servant writes.
#include <cmath>
#include <limits>

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

const SettingsRecord kSettings{0.5, {0.25, 0.5, 0.75, 1.0, 1.0, 1.0}, -0.5};

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
    own.state.settings.store({1.0, {1, 1, 1, 1, 1, 1}, 0.75});
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
  std::vector<SettingsRecord> forged(8, kSettings);
  forged[0].speed_ratio = 0.0;
  forged[1].speed_ratio = kNan;
  forged[2].speed_ratio = 1.0 + 1e-12;
  forged[3].joint_speed_ratio[5] = -0.5;
  forged[4].joint_speed_ratio[0] = kInfinity;
  forged[5].tool_pitch_rad = kNan;
  forged[6].tool_pitch_rad = 4.0;
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

}  // namespace
}  // namespace test
}  // namespace corbot
