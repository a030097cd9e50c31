// SPDX-License-Identifier: Apache-2.0
// The gripper by its opening, down to an emulated drive that closes on a piece.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include <fmt/core.h>

#include "support/device_jobs.h"
#include "support/emulated_drives.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

/// A gripper on a servo, which reports nothing.
class Gripper : public RobotRig {};

TEST_F(Gripper, GoesToAnOpening) {
  arm_->SetGripper(35.0);
  Corbot::GripperInfo info = arm_->Gripper();
  EXPECT_NEAR(info.commanded, 35.0, 1e-6);
  EXPECT_FALSE(info.measured);
  EXPECT_EQ(info.opening, info.commanded);
  EXPECT_EQ(info.holding, Corbot::HoldingUnknown);
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Close) << "less than half open";
  Corbot::MotionInfo_var end = arm_->Wait(arm_->StartSetGripper(80.0), 30.0);
  EXPECT_EQ(end->state, Corbot::MotionDone);
  EXPECT_GT(end->duration, 0.45 * 0.5);
  EXPECT_LT(end->duration, 0.5) << "travel_s is for all of the way";
  EXPECT_NEAR(arm_->Gripper().commanded, 80.0, 1e-6);
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Open);
  arm_->SetGripper(0.0);
  arm_->SetGripper(100.0);
  const Corbot::ArmState_var state = arm_->State();
  EXPECT_NEAR(state->gripper.commanded, 100.0, 1e-6);
}

TEST_F(Gripper, RefusesWhatIsNoOpening) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {-0.001, 100.001, kNaN, -HUGE_VAL, HUGE_VAL}) {
    try {
      arm_->SetGripper(wrong);
      ADD_FAILURE() << wrong;
    } catch (const Corbot::BadParameter& refused) {
      EXPECT_STREQ(refused.parameter, "percent");
    }
    EXPECT_EQ(raised_by([&] { arm_->StartSetGripper(wrong); }), "BadParameter") << wrong;
  }
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
}

/// With drives, the gripper's among them.
class MeasuredGripper : public RobotRig {
 protected:
  static constexpr int kClosed = 0;
  static constexpr int kOpen = 40'000;
  static constexpr int kNode = 5;
  /// 5 % of the travel, and what the gripper may move in two periods of 4 ms.
  static constexpr int kLead = 2000 + 2 * 4 * 160;

  void SetUp() override {
    take_name("grip");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    drives_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", directory_, kNode);
    drives_->start();
    if (HasFatalFailure()) return;
    profile_ = directory_ + "/arm.toml";
    std::string backend = fmt::format(
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"{}\"\n", drives_->bus());
    for (int node = 1; node < kNode; ++node) {
      backend += fmt::format(
          "[[backend.socketcan.drive]]\nnode = {}\ncounts_per_degree = 1000.0\nzero_count = 0\n"
          "direction = 1\n",
          node);
    }
    backend += fmt::format("[backend.socketcan.gripper]\nnode = {}\nclosed_count = {}\nopen_count = {}\n",
                           kNode, kClosed, kOpen);
    write_lynx5_profile(profile_, backend);
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    EXPECT_EQ(drives_->stop(), 0);
    fs::remove_all(directory_);
  }
  bool is_holding(Corbot::HoldingState expected) {
    return wait_until(within(20), [&] { return arm_->Gripper().holding == expected; });
  }
  /// Its reason where it is refused.
  template <class Call>
  void carry_out(Call&& call) {
    try {
      call();
    } catch (const Corbot::NotReady& refused) {
      FAIL() << refused.reason.in() << "\n" << rt_->errors();
    }
  }
  /// But for what a busy machine adds by itself: a device that takes fewer frames.
  void expect_no_fault() {
    constexpr CORBA::Long kDegraded = 120;
    for (const Corbot::AlarmInfo& alarm : alarms()) EXPECT_EQ(alarm.code, kDegraded) << alarm.text.in();
  }
  int lead() { return std::abs(drives_->counts("targets").at(kNode) - drives_->counts().at(kNode)); }

  std::string directory_;
  std::optional<EmulatedDrives> drives_;
};

TEST_F(MeasuredGripper, SaysWhereItsFingersAre) {
  arm_->SetGripper(60.0);
  const Corbot::GripperInfo info = arm_->Gripper();
  EXPECT_NEAR(info.commanded, 60.0, 1e-6);
  EXPECT_TRUE(info.measured);
  EXPECT_NEAR(info.opening, 60.0, 2.0);
  EXPECT_EQ(info.holding, Corbot::HoldingNo);
  EXPECT_TRUE(wait_until(within(20), [&] { return drives_->counts().at(kNode) == 24'000; }));
}

TEST_F(MeasuredGripper, HoldsAPieceAndGoesOnWithIt) {
  carry_out([&] { arm_->Open(); });
  drives_->command("piece 31000 5");
  Corbot::MotionInfo_var end = arm_->Wait(arm_->StartClose(), 30.0);
  EXPECT_EQ(end->state, Corbot::MotionDone) << end->reason.in();
  Corbot::GripperInfo info = arm_->Gripper();
  EXPECT_NEAR(info.commanded, 0.0, 1e-6);
  EXPECT_NEAR(info.opening, 77.5, 0.1);
  EXPECT_EQ(info.holding, Corbot::HoldingYes);
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Close) << "what it was last told";
  EXPECT_LE(lead(), kLead) << "no harder than a small lead makes it";
  EXPECT_GT(lead(), 0) << "and it does press";

  carry_out([&] { arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0); });
  EXPECT_EQ(arm_->Gripper().holding, Corbot::HoldingYes);
  Corbot::DeviceInfo_var device = arm_->Device();
  EXPECT_NE(device->health, Corbot::DeviceLost) << device->causeText.in();
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  expect_no_fault();

  drives_->command("piece off 5");
  EXPECT_TRUE(is_holding(Corbot::HoldingNo)) << "it was lost: the fingers go on, and find nothing";
  EXPECT_NEAR(arm_->Gripper().opening, 0.0, 2.0);
  EXPECT_LE(drives_->largest_steps().first, 2 * 4 * 320 + 1) << "and they do not jump";
  carry_out([&] { arm_->Open(); });
  EXPECT_EQ(arm_->Gripper().holding, Corbot::HoldingNo);
  EXPECT_NEAR(arm_->Gripper().opening, 100.0, 2.0);
}

TEST_F(MeasuredGripper, OpensFromAPiece) {
  carry_out([&] { arm_->Open(); });
  drives_->command("piece 20000 5");
  carry_out([&] { arm_->SetGripper(10.0); });
  ASSERT_EQ(arm_->Gripper().holding, Corbot::HoldingYes);
  carry_out([&] { arm_->SetGripper(70.0); });
  EXPECT_EQ(arm_->Gripper().holding, Corbot::HoldingNo);
  EXPECT_NEAR(arm_->Gripper().opening, 70.0, 2.0);
  expect_no_fault();
}

}  // namespace
}  // namespace corbot::test
