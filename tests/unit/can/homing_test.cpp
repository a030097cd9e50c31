// SPDX-License-Identifier: Apache-2.0
// Drives without absolute encoders: refused until a person has had them homed.
#include <numbers>

#include "rt/backends/can/drive_homing.h"
#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class IncrementalDrives : public Drives {
 protected:
  IncrementalDrives() {
    settings_.home_command = "corbot home lynx.toml";
    for (JointDrive& joint : settings_.joints)
      joint.homing = HomingSettings{19, 20'000, 4'000, 400'000u, 700};
  }
  void SetUp() override {
    Drives::SetUp();
    emulator_.command("incremental on 1");
    emulator_.command("incremental on 2");
    emulator_.command("switch home 14000 1");
    emulator_.command("switch home 13000 2");
  }
  static bool always() { return true; }
  static bool never() { return false; }
};

TEST_F(IncrementalDrives, AreRefusedUntilTheyAreHomed) {
  EXPECT_THAT(refused().what(), AllOf(HasSubstr("node 1: has not been homed since its power-up"),
                                      HasSubstr("type 'corbot home lynx.toml'")));
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
  DriveHoming homing(settings_);
  homing.open();
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled) << "nothing is energised by that";
  ASSERT_TRUE(homing.energise(never));
  EXPECT_TRUE(homing.home(0, always));
  EXPECT_NEAR(homing.count(0), 700, 40) << "607Ch";
  EXPECT_NEAR(homing.position_q(0), 700 / kCountsPerRad, 40 / kCountsPerRad);
  EXPECT_EQ(homing.count(1), kStandsAt) << "holds";
  homing.relax();
  EXPECT_THAT(refused().what(), HasSubstr("node 2: has not been homed"));
  DriveHoming second(settings_);
  second.open();
  ASSERT_TRUE(second.energise(never));
  EXPECT_TRUE(second.home(1, always));
  second.leave();
  open();
  EXPECT_EQ(backend_->health(), BackendHealth::kOpen) << log_;
  backend_->close();
  backend_.reset();
  emulator_.command("reset 2");
  EXPECT_THAT(refused().what(), HasSubstr("node 2: has not been homed since its power-up"));
}

TEST_F(IncrementalDrives, AreHaltedAtAPersonsWord) {
  emulator_.command("switch home 900000 1");  // farther than it comes while a machine stands still
  DriveHoming homing(settings_);
  homing.open();
  ASSERT_TRUE(homing.energise(never));
  int looks = 0;
  EXPECT_FALSE(homing.home(0, [&] { return ++looks < 20; }));
  const std::int32_t at = homing.count(0);
  EXPECT_LT(at, 900'000);
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled) << "and holds";
  EXPECT_EQ(emulator_.counts().at(1), at);
  homing.leave();
  EXPECT_THAT(refused().what(), HasSubstr("node 1: has not been homed")) << "though it is enabled";
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled) << "still";
  EXPECT_EQ(emulator_.counts().at(1), at);
}

TEST_F(IncrementalDrives, DoNotBeginWhenThatIsStoppedBefore) {
  settings_.stagger_ms = 20;
  DriveHoming homing(settings_);
  homing.open();
  int looks = 0;
  EXPECT_FALSE(homing.energise([&] {  // when the first one is enabled
    return ++looks > 1000 || state_of_node(1) == DriveState::kOperationEnabled;
  }));
  for (std::uint8_t node = 1; node <= 3; ++node)
    EXPECT_EQ(state_of_node(node), DriveState::kSwitchOnDisabled) << static_cast<int>(node);
  ASSERT_TRUE(homing.energise(never));
  EXPECT_FALSE(homing.home(0, never));
  EXPECT_EQ(homing.count(0), kStandsAt) << "has not moved";
  homing.relax();
}

TEST_F(IncrementalDrives, StayWhereTheyHoldWhenTheyAreAskedAgain) {
  DriveHoming homing(settings_);
  homing.open();
  ASSERT_TRUE(homing.energise(never));
  EXPECT_TRUE(homing.home(0, always));
  EXPECT_TRUE(homing.home(1, always));
  homing.leave();
  const auto before = emulator_.counts();
  {
    CanPort port;
    port.open(emulator_.bus(), {kSdoAnswer + 1});
    DriveWatch watch({1});
    SdoClient sdo(port, watch, 1);
    sdo.write({0x6060}, kHoming, 1);
    sdo.write({0x607A}, 100'000, 4);  // a target that nobody wants
  }
  Cia402Drives drives(settings_);
  drives.open();
  for (int i = 0; i < 50; ++i) (void)drives.measure(frame());
  EXPECT_EQ(emulator_.counts(), before);
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled);
}

TEST_F(IncrementalDrives, AreStoppedWhenTheSwitchIsNotFound) {
  emulator_.command("switch home 900000 1");
  emulator_.command("switch positive 13000 1");
  DriveHoming homing(settings_);
  homing.open();
  ASSERT_TRUE(homing.energise(never));
  try {
    (void)homing.home(0, always);
    FAIL() << "homed";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("node 1 has not found its home position (statusword bit 13)"));
  }
  homing.stop();
  EXPECT_TRUE(wait_until(within(30), [&] { return state_of_node(2) == DriveState::kSwitchOnDisabled; }));
}

TEST_F(IncrementalDrives, AreStoppedWhenOneLosesItsTorque) {
  emulator_.command("switch home 900000 1");
  DriveHoming homing(settings_);
  homing.open();
  ASSERT_TRUE(homing.energise(never));
  int looks = 0;
  try {
    (void)homing.home(0, [&] {
      if (++looks == 20) emulator_.command("sto on 2");
      return true;
    });
    FAIL() << "homed";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kTorqueOff) << error.what();
  }
  homing.stop();
  EXPECT_TRUE(wait_until(within(30), [&] { return state_of_node(1) == DriveState::kSwitchOnDisabled; }));
}

TEST_F(IncrementalDrives, AreRefusedWithAMethodThatTheyHaveNot) {
  settings_.joints[1].homing->method = 33;
  DriveHoming homing(settings_);
  try {
    homing.open();
    FAIL() << "opened";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("node 2: 6098h is 0x00, 0x21 is needed: value out of range"));
  }
}

}  // namespace
}  // namespace corbot::rt
