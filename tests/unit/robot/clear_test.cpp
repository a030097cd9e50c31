// SPDX-License-Identifier: Apache-2.0
// Clear after a fault: not before the arm is at rest; and what a motion after it is planned from.
#include <fmt/format.h>

#include "corbot/channel/alarms.h"
#include "corbot/units.h"
#include "robot/task_fixture.h"

namespace corbot::test::clear_test {
namespace {

class Clear : public TaskTest {
 protected:
  void SetUp() override {
    task_.run();
    open_robot();
  }
  void TearDown() override { robot_.reset(); }

  void fail(std::uint32_t flags) {
    task_.change([flags](Snapshot& now) {
      now.state = RtState::kError;
      now.flags = flags;
    });
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_ERROR; }));
  }
  [[nodiscard]] std::uint64_t clears() const { return task_.servant().control.clear_count.load(); }
  /// As the task does with the Clear that is asked for.
  void carry_out_clear(RtState state) {
    ASSERT_TRUE(wait_until(within(30), [&] { return clears() == 1; }));
    task_.change([&](Snapshot& now) {
      now.clears_done = 1;
      now.state = state;
      now.flags = 0;
    });
  }

  FakeTask task_{name_, profile_.arm};
};

TEST_F(Clear, WaitsUntilAFaultHasSlowedTheArmDown) {
  fail(kSnapshotFaultStop);
  corbot_status status = CORBOT_INTERNAL;
  std::thread caller([&] { status = status_of([&] { robot_->clear(); }); });
  std::uint64_t begun = 0;
  task_.change([&](Snapshot& now) { begun = now.cycle; });
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().snapshot().cycle > begun + 50; }));
  EXPECT_EQ(clears(), 0u) << "the task would refuse it";
  task_.change([](Snapshot& now) { now.flags = kSnapshotPowerOff; });
  carry_out_clear(RtState::kStandby);
  caller.join();
  EXPECT_EQ(status, CORBOT_OK);
}

TEST_F(Clear, DoesNotEndAHoldThatCameWhileItWaited) {
  fail(kSnapshotFaultStop);
  (void)robot_->count_stop();
  const std::uint64_t arrival = task_.stop_count();
  std::atomic<bool> waits{false};
  std::thread caller([&] {
    EXPECT_EQ(status_of([&] { robot_->clear([&] { waits = true; }, arrival); }), CORBOT_NOT_READY);
  });
  EXPECT_TRUE(wait_until(within(30), [&] { return waits.load(); }));
  (void)robot_->count_stop(true);
  task_.change([&](Snapshot& now) {
    now.stops_done = task_.stop_count();
    now.holds_done = 1;
    now.flags = kSnapshotHeld;
  });
  caller.join();
  EXPECT_EQ(clears(), 0u);
}

TEST_F(Clear, AMotionAfterItIsPlannedFromWhereTheDeviceSaysTheArmIs) {
  task_.change([](Snapshot& now) { now.position_q = {}; });
  fail(kSnapshotPowerOff);
  const Joints fallen{0.1, 0.4, 0.6, 0.2};
  task_.change([&](Snapshot& now) { now.position_q = fallen; });
  std::thread caller([&] { EXPECT_EQ(status_of([&] { robot_->clear(); }), CORBOT_OK); });
  carry_out_clear(RtState::kMoving);  // the servos are being energised
  caller.join();
  const Outcome outcome = try_accept(DwellRequest{1.0});
  ASSERT_EQ(outcome.status, CORBOT_OK) << outcome.text;
  EXPECT_EQ(task_.next().start_q, fallen);
}

TEST_F(Clear, SaysWhichJointWouldMove) {
  fail(kSnapshotPowerOff);
  for (const std::uint64_t count : {1u, 2u}) {
    corbot_error refusal{};
    std::thread caller([&] {
      try {
        robot_->clear();
      } catch (const CallError& error) {
        refusal = error.error;
      }
    });
    EXPECT_TRUE(wait_until(within(30), [&] { return clears() == count; }));
    task_.fail(alarm::joint_beyond_range({.joint = 1,
                                          .position_q = to_radians(count == 1 ? 150.0 : 140.0),
                                          .lower_q = to_radians(-30.0),
                                          .upper_q = to_radians(130.0)}));
    task_.change([&](Snapshot& now) { now.clears_done = count; });
    caller.join();
    EXPECT_EQ(refusal.status, CORBOT_NOT_READY);
    EXPECT_EQ(std::string(refusal.text),
              std::string("joint 1 is at ") + (count == 1 ? "150.0" : "140.0") +
                  " degrees, outside its range of -30.0 to 130.0: nothing moves by itself; "
                  "turn it back by hand; fix the cause, then clear");
  }
  const std::vector<AlarmEntry> list = robot_->view().alarms();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_FALSE(list[0].active) << "where it is by now is what counts";
  EXPECT_TRUE(list[1].active);
}

TEST_F(Clear, ADeviceThatStandsByIsClosedAndSaysWhy) {
  task_.change(
      [](Snapshot& now) { now.device_health = static_cast<std::uint32_t>(BackendHealth::kStandby); });
  fail(kSnapshotPowerOff);
  corbot_device_info device = robot_->view().device();
  EXPECT_EQ(device.health, CORBOT_DEVICE_CLOSED);
  EXPECT_STREQ(device.cause_text, "no energy until Clear");
  task_.change([](Snapshot& now) { now.state = RtState::kMoving; });
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_WAITING; }));
  device = robot_->view().device();
  EXPECT_EQ(device.health, CORBOT_DEVICE_CLOSED);
  EXPECT_STREQ(device.cause_text, "its servos are being energised");
  task_.change([](Snapshot& now) {
    now.state = RtState::kError;
    now.device_cause = to_number(DeviceCause::kTorqueOff);
  });
  ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() == CORBOT_STATE_ERROR; }));
  EXPECT_STREQ(robot_->view().device().cause_text, device_cause_text(DeviceCause::kTorqueOff));
  task_.change([](Snapshot& now) { now.device_cause = to_number(DeviceCause::kNoAnswer); });
  const std::string back =
      fmt::format("no energy until Clear (after: {})", device_cause_text(DeviceCause::kNoAnswer));
  EXPECT_TRUE(wait_until(within(30), [&] { return robot_->view().device().cause_text == back; }))
      << robot_->view().device().cause_text;
}

}  // namespace
}  // namespace corbot::test::clear_test
