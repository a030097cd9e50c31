// SPDX-License-Identifier: Apache-2.0
// A device that is lost in mid-motion: Error, the cause in the alarms, typed refusals, and the way back.
#include <signal.h>

#include <thread>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class ErrorState : public RobotRig {
 protected:
  void lose_device() { rt_->signal(SIGUSR1); }
  void find_device() { rt_->signal(SIGUSR2); }
};

TEST_F(ErrorState, ALostDeviceFaultsTheMotionAndIsClearedOnceItIsBack) {
  std::string raised;
  std::thread caller([&] { raised = raised_by([&] { arm_->Move(0.20, 0.10, 0.10, 0.0, 20.0); }); });
  const Corbot::JointCoord_var before = arm_->ArtiCoord();
  EXPECT_TRUE(wait_until(
      within(30), [&] { return distance_deg(before, Corbot::JointCoord_var(arm_->ArtiCoord())) > 1.0; }));
  lose_device();
  EXPECT_TRUE(wait_for(Corbot::Error));
  caller.join();
  EXPECT_EQ(raised, "NotReady");
  Corbot::JointCoord_var where = arm_->ArtiCoord();

  expect_no_motion_accepted();
  arm_->Stop();  // nothing to stop, and no exception
  try {
    arm_->Clear();
    ADD_FAILURE() << "cleared while the device is lost";
  } catch (const Corbot::NotReady& error) {
    EXPECT_NE(std::string(error.reason).find("device"), std::string::npos) << error.reason;
  }
  ASSERT_GE(alarms().size(), 1u);
  const Corbot::AlarmInfo first = alarms().front();
  EXPECT_EQ(first.code, 121);
  EXPECT_TRUE(first.active);
  EXPECT_GT(first.time, 1.6e9);
  EXPECT_STRNE(first.text, "");

  find_device();
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  Corbot::JointCoord_var still = arm_->ArtiCoord();
  EXPECT_LE(distance_deg(where, still), 0.25)
      << "but for cycles that the device no longer took; the contract's Standby tests watch the device";
  EXPECT_FALSE(alarms().at(0).active);
  arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
}

TEST_F(ErrorState, ErrorStaysUntilItIsCleared) {
  lose_device();
  ASSERT_TRUE(wait_for(Corbot::Error));
  find_device();
  EXPECT_EQ(raised_by([&] { arm_->Ready(); }), "NotReady");
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  arm_->Ready();
}

TEST_F(ErrorState, ClearWithoutErrorDoesNothing) {
  arm_->Clear();
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
}

/// A hold is one alarm, whichever client requests it again, and whichever process is replaced meanwhile.
TEST_F(ErrorState, AHoldIsListedOnceWhileItIsActive) {
  const auto listed = [&](bool is_active) {
    int count = 0;
    for (const Corbot::AlarmInfo& alarm : alarms()) count += alarm.code == 133 && alarm.active == is_active;
    return count;
  };
  const auto is_held = [&] {
    try {
      Corbot::ControlInfo_var info = arm_->Control();
      return info->held && arm_->Status() == Corbot::Error;
    } catch (const CORBA::SystemException&) {
      return false;  // the connection to a servant that died; the next call makes a new one
    }
  };
  for (int i = 0; i < 3; ++i) arm_->StopAndHold();
  EXPECT_EQ(listed(true), 1);
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  start_servant();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), is_held));
  arm_->StopAndHold();
  EXPECT_EQ(listed(true), 1);
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  start_rt();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(
      wait_until(within(30), [&] { return is_held() && raised_by([&] { arm_->StopAndHold(); }).empty(); }));
  EXPECT_EQ(listed(true), 1);
  EXPECT_EQ(listed(false), 0);
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  arm_->StopAndHold();
  EXPECT_EQ(listed(true), 1) << "another";
  EXPECT_EQ(listed(false), 1);
  arm_->Clear();
}

}  // namespace
}  // namespace corbot::test
