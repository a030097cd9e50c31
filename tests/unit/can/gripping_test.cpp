// SPDX-License-Identifier: Apache-2.0
// A gripper's drive that closes on something.
#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

constexpr int kWindow = 1000;  // 6065h, 3E8h

class GrippingDrives : public Drives {
 protected:
  void open_and_hold() {
    emulator_.command("store 6065 3E8 3");
    drives_.emplace(settings_);
    (void)drives_->open();
    ASSERT_TRUE(drives_->energise([] { return false; }));
  }
  /// Runs one cycle with a command to close the gripper.
  void close_further() {
    ServoFrame now = frame();
    now.pulse_us[2] = arm_.gripper.closed_us;
    drives_->send(now, false);
    (void)drives_->measure(now);
  }
  bool closes_until(std::int32_t position, std::int32_t target) {
    return wait_until(within(30), [&] {
      close_further();
      return emulator_.counts().at(3) == position && emulator_.counts("targets").at(3) == target;
    });
  }

  std::optional<Cia402Drives> drives_;
};

TEST_F(GrippingDrives, PressWithinHalfOfTheirFollowingWindowAndAreNoFault) {
  open_and_hold();
  emulator_.command("piece 9000 3");
  ASSERT_TRUE(closes_until(9000, 9000 - kWindow / 2));
  // For longer than the drive lets a following error last.
  const auto end = CanPort::Clock::now() + std::chrono::milliseconds(300);
  EXPECT_TRUE(wait_until(within(30), [&] {
    close_further();
    return CanPort::Clock::now() > end;
  }));
  EXPECT_EQ(state_of_node(3), DriveState::kOperationEnabled);
  CanPort port;
  port.open(emulator_.bus(), {kSdoAnswer + 3});
  DriveWatch watch({3});
  EXPECT_NE(SdoClient(port, watch, 3).read({0x6041}) & kStatusInternalLimit, 0u) << "it says that it presses";
  EXPECT_FALSE(drives_->warning()) << "which is what a gripper does";
}

TEST_F(GrippingDrives, GoOnWhenThePieceIsGone) {
  open_and_hold();
  emulator_.command("piece 9000 3");
  ASSERT_TRUE(closes_until(9000, 9000 - kWindow / 2));
  emulator_.command("piece off 3");
  EXPECT_TRUE(closes_until(0, 0));
  EXPECT_FALSE(drives_->warning());
}

TEST_F(GrippingDrives, AJointsDriveAtALimitIsStillWarnedOf) {
  open_and_hold();
  emulator_.command("piece 12100 1");  // short of where the frame has joint 1
  EXPECT_TRUE(wait_until(within(30), [&] {
    close_further();
    const auto warning = drives_->warning();
    return warning &&
           std::string(warning->what()).find("node 1 is at an internal limit") != std::string::npos;
  }));
}

}  // namespace
}  // namespace corbot::rt
