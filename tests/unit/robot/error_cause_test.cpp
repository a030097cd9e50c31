// SPDX-License-Identifier: Apache-2.0
// A client that sees Error finds its cause, however soon after it the client looks.
#include <fmt/format.h>

#include "corbot/channel/alarms.h"
#include "robot/task_fixture.h"

namespace corbot::test::error_cause_test {
namespace {

class ErrorCause : public TaskTest {
 protected:
  void SetUp() override {
    task_.run();
    open_robot();
  }
  void TearDown() override { robot_.reset(); }

  FakeTask task_{name_, profile_.arm};
};

TEST_F(ErrorCause, IsAmongTheAlarmsAsSoonAsTheStateIsError) {
  for (int joint = 0; joint < 40; ++joint) {
    task_.fail(alarm::joint_beyond_range(
        {.joint = joint % 4, .position_q = 2.0 + joint, .lower_q = 0.0, .upper_q = 1.0}));
    ASSERT_EQ(robot_->view().state(), CORBOT_STATE_ERROR);
    const std::vector<AlarmEntry> alarms = robot_->view().alarms();
    ASSERT_EQ(alarms.size(), static_cast<std::size_t>(joint) + 1);
    EXPECT_TRUE(alarms.back().active);
    task_.change([](Snapshot& now) { now.state = RtState::kStandby; });
  }
}

TEST_F(ErrorCause, IsNamedByTheFirstRefusal) {
  for (int joint = 0; joint < 4; ++joint) {
    task_.fail(
        alarm::joint_beyond_range({.joint = joint, .position_q = 2.0, .lower_q = 0.0, .upper_q = 1.0}));
    const std::string cause = robot_->view().error_cause();
    EXPECT_NE(cause.find(fmt::format("joint {}", joint)), std::string::npos) << cause;
    const Outcome refused = try_accept(DwellRequest{1.0});
    EXPECT_EQ(refused.status, CORBOT_NOT_READY);
    EXPECT_NE(refused.text.find(fmt::format("joint {}", joint)), std::string::npos) << refused.text;
    task_.change([](Snapshot& now) { now.state = RtState::kStandby; });
  }
}

TEST_F(ErrorCause, OfAHoldIsNoFault) {
  task_.fail(alarm::held());
  const std::string held = robot_->view().error_cause();
  EXPECT_NE(held.find("nothing is faulty: 'corbot clear' ends the hold"), std::string::npos) << held;
  EXPECT_EQ(held.find("fix the cause"), std::string::npos) << held;
}

TEST_F(ErrorCause, OfAFaultOutranksAHold) {
  task_.fail(alarm::joint_beyond_range({.joint = 1, .position_q = 2.0, .lower_q = 0.0, .upper_q = 1.0}));
  task_.fail(alarm::held());
  const std::string cause = robot_->view().error_cause();
  EXPECT_EQ(cause.find("joint 1 "), 0u) << cause;
  EXPECT_NE(cause.find("fix the cause, then clear"), std::string::npos) << cause;
}

TEST_F(ErrorCause, OfATaskThatIsGoneIsAmongTheAlarms) {
  for (int death = 0; death < 15; ++death) {
    task_.die();
    while (robot_->view().state() != CORBOT_STATE_ERROR) {
    }
    const std::vector<AlarmEntry> alarms = robot_->view().alarms();
    ASSERT_FALSE(alarms.empty());
    ASSERT_EQ(alarms.back().code, kAlarmTaskGone) << death;
    EXPECT_TRUE(alarms.back().active);
    task_.adopt();
    task_.run();
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  }
}

}  // namespace
}  // namespace corbot::test::error_cause_test
