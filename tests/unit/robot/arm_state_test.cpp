// SPDX-License-Identifier: Apache-2.0
// One reading of everything: all of it of one snapshot.
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "corbot/units.h"
#include "robot/task_fixture.h"

namespace corbot::test::arm_state_test {
namespace {

using ::testing::HasSubstr;

class ArmState : public TaskTest {
 protected:
  void SetUp() override {
    task_ = std::make_unique<FakeTask>(name_, profile_.arm);
    task_->run();
    open_robot();
  }
  [[nodiscard]] corbot_arm_state read() const { return robot_->view().arm_state(); }

  std::unique_ptr<FakeTask> task_;
};

TEST_F(ArmState, IsOfOneSnapshot) {
  std::atomic<bool> end{false};
  std::thread writer([&] {
    for (std::uint64_t k = 1; !end; ++k) {
      task_->change([&](Snapshot& now) {
        const double mark = static_cast<double>(k % 1000);
        now.position_q.fill(mark * 1e-4);
        now.velocity_q_s.fill(mark * 1e-4);
        now.measured_q.fill(mark * 1e-4);
        now.tool.position_m = {mark, mark, mark};
        now.gripper = mark * 1e-3;
        now.measured_opening = mark * 1e-3;
        now.device_frames = k % 1000;
        now.override_ratio = mark * 1e-3;
        now.wall_ns = static_cast<std::int64_t>(k % 1000) * 1'000'000'000;
        now.flags = (k % 2 == 0 ? kSnapshotPaused | kSnapshotMeasured : kSnapshotHeld | kSnapshotMeasured);
      });
      const timespec pause{0, 5'000};
      ::nanosleep(&pause, nullptr);
    }
  });
  for (int i = 0; i < 20'000 && !HasFailure(); ++i) {
    const corbot_arm_state now = read();
    const double mark = std::round(10.0 * now.override_percent);
    if (mark == 0.0) continue;
    for (int j = 0; j < CORBOT_MAX_JOINTS; ++j) {
      EXPECT_NEAR(to_radians(now.commanded[j]), mark * 1e-4, 1e-12);
      EXPECT_NEAR(to_radians(now.measured_joints[j]), mark * 1e-4, 1e-12);
      EXPECT_NEAR(to_radians(now.speed[j]), mark * 1e-4, 1e-12);
    }
    Joints commanded_q;
    commanded_q.fill(mark * 1e-4);
    const Pose tool = profile_.arm.kinematics.forward(commanded_q);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(now.tool_commanded.position_m[j], tool.position_m[j], 1e-12);
      EXPECT_NEAR(now.tool.position_m[j], tool.position_m[j], 1e-12);
    }
    EXPECT_NEAR(now.gripper.commanded_percent, 0.1 * mark, 1e-9);
    EXPECT_NEAR(now.gripper.opening_percent, 0.1 * mark, 1e-9);
    EXPECT_NEAR(static_cast<double>(now.device.frames), mark, 1e-9);
    EXPECT_NEAR(now.override_percent, 0.1 * mark, 1e-9);
    EXPECT_NEAR(now.time_s, mark, 1e-9);
    EXPECT_NE(now.paused, now.held) << mark;
  }
  end = true;
  writer.join();
}

TEST_F(ArmState, AMotionOfTwoCommandsIsOneMotionAlsoBetweenThem) {
  const MoveCRequest arc{{0.20, -0.03, 0.10}, {0.22, 0.0, 0.12}, {0.20, 0.03, 0.10}};
  task_->change([](Snapshot& now) { now.override_ratio = 1.0; });
  const Outcome accepted = try_accept(arc);
  ASSERT_EQ(accepted.status, CORBOT_OK) << accepted.text;
  const Outcome next = try_accept(DwellRequest{1.0});
  ASSERT_EQ(next.status, CORBOT_OK) << next.text;
  EXPECT_EQ(read().motion.id, 0u);
  EXPECT_EQ(read().queued, 2u);
  EXPECT_EQ(read().status, CORBOT_STATE_WAITING) << "accepted, though the task has not begun";

  task_->begin();
  task_->change([](Snapshot& now) { now.virtual_time_s = 0.1; });
  corbot_arm_state now = read();
  EXPECT_EQ(now.motion.id, accepted.ticket);
  EXPECT_EQ(now.motion.state, CORBOT_MOTION_RUNNING);
  EXPECT_EQ(now.queued, 1u);
  const double first_progress = now.motion.progress;
  EXPECT_GT(first_progress, 0.0);

  task_->complete(Verdict::kDone);
  task_->change([](Snapshot& snapshot) { snapshot.virtual_time_s = 0.0; });
  now = read();
  EXPECT_EQ(now.motion.id, accepted.ticket) << "no command runs in this snapshot";
  EXPECT_EQ(now.status, CORBOT_STATE_WAITING);
  EXPECT_GE(now.motion.progress, first_progress);
  EXPECT_EQ(now.queued, 1u);

  task_->begin();
  task_->complete(Verdict::kDone);
  EXPECT_TRUE(wait_until(within(30), [&] { return read().motion.id == 0 && read().queued == 1; }));
}

TEST_F(ArmState, AMotionThatNobodyHasATicketOfIsShownByItsCommand) {
  task_->change([](Snapshot& now) {
    now.command_id = 77;
    now.state = RtState::kMoving;
    now.virtual_time_s = 1.0;
    now.command_duration_s = 4.0;
  });
  const corbot_arm_state now = read();
  EXPECT_EQ(now.motion.id, 77u);
  EXPECT_NEAR(now.motion.progress, 0.25, 1e-12);
  EXPECT_EQ(now.status, CORBOT_STATE_WAITING);
}

TEST_F(ArmState, ATaskThatStandsInsideItsStoreLeavesThePositionOfTheCycleBefore) {
  task_->stand_inside_store();
  JointRanges narrow;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    narrow.lower_q[i] = to_degrees(profile_.arm.joints[i].lower_q);
    narrow.upper_q[i] = to_degrees(profile_.arm.joints[i].upper_q);
  }
  narrow.lower_q[0] = 10.0;
  try {
    robot_->set_soft_limits(narrow);
    FAIL() << "joint 0 stands at 0";
  } catch (const CallError& refused) {
    EXPECT_THAT(refused.error.text, HasSubstr("joint 0 stands at 0 degrees, outside the wanted limits"));
  }
}

TEST_F(ArmState, ATaskThatStandsInsideItsStoreIsFrozen) {
  robot_.reset();
  Profile watched = profile_;
  watched.frozen_ns = 200'000'000;
  robot_ = std::make_unique<Robot>(watched, name_);
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_STANDBY; }));
  task_->stand_inside_store();
  EXPECT_TRUE(wait_until(within(30), [&] {
    return try_accept(ReadyRequest{}).text.find("does not respond") != std::string::npos;
  })) << try_accept(ReadyRequest{}).text;
}

}  // namespace
}  // namespace corbot::test::arm_state_test
