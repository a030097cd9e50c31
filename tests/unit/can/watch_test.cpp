// SPDX-License-Identifier: Apache-2.0
// Drives that await corbot's heartbeat, and what they do without it.
#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class WatchingDrives : public Drives {
 protected:
  WatchingDrives() { settings_.watch_ms = 300; }
  std::uint32_t awaited_by(std::uint8_t node) {
    CanPort port;
    port.open(emulator_.bus(), {kSdoAnswer + node});
    DriveWatch watch({node});
    return SdoClient(port, watch, node).read({0x1016, 1});
  }
};

TEST_F(WatchingDrives, ReactWhenTheMasterFallsSilent) {
  CanPort port;
  port.open(emulator_.bus(), {kHeartbeat + kMasterNode});
  CanPort emergencies;
  emergencies.open(emulator_.bus(), {kEmergency + 1});
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  EXPECT_EQ(awaited_by(3), 0x7F'012Cu);
  int beats = 0;
  ASSERT_TRUE(wait_until(within(30), [&] {
    try {
      drives.send(frame(), false);
      (void)drives.measure(frame());
    } catch (const DeviceError&) {  // the machine stood still for longer than they wait
      drives.close();
      drives.open();
      (void)drives.energise([] { return false; });
      beats = 0;
    }
    while (const auto beat = port.read(CanPort::Clock::time_point{})) beats += beat->data[0] == 5 ? 1 : 0;
    return beats >= 10;  // three times as long as they would wait
  }));
  while (emergencies.read(CanPort::Clock::time_point{})) {
  }
  const auto emergency = emergencies.read(CanPort::Clock::now() + std::chrono::seconds(10));
  ASSERT_TRUE(emergency);
  EXPECT_EQ(little_endian(*emergency, 0, 2), 0x8130u);
  EXPECT_TRUE(wait_until(within(30), [&] {  // the second one may receive it a little later
    try {
      drives.send(frame(), false);
      return false;
    } catch (const DeviceError&) {
      return true;
    }
  }));
  drives.close();
  drives.open();
  (void)drives.energise([] { return false; });
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled) << "it is reset";
}

TEST_F(WatchingDrives, HearTheMasterWhileTheyAreEnabledOneAfterAnother) {
  settings_.stagger_ms = 400;
  Cia402Drives drives(settings_);
  drives.open();
  EXPECT_TRUE(wait_until(within(60), [&] {
    try {
      (void)drives.measure(frame());  // the first heartbeat
      return drives.energise([] { return false; });
    } catch (const DeviceError&) {  // the machine stood still for longer than they wait: not every time
      return false;
    }
  }));
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled);
}

TEST_F(WatchingDrives, GoOnHoldingAtTheEnd) {
  settings_.watch_ms = 30'000;  // the machine may stand still
  open();
  ASSERT_TRUE(arrives());
  EXPECT_EQ(awaited_by(1), 0x7F'7530u);
  backend_->close();
  for (std::uint8_t node = 1; node <= 3; ++node) {
    EXPECT_EQ(awaited_by(node), 0u);
    EXPECT_EQ(state_of_node(node), DriveState::kOperationEnabled);
  }
}

TEST_F(WatchingDrives, LoseTheirVoltageAndAreWatchedOnWhenAStartIsGivenUp) {
  settings_.watch_ms = 30'000;  // the machine may stand still before the drives are enabled
  backend_ = std::make_unique<BusBackend>(arm_, std::make_unique<Cia402Drives>(settings_),
                                          BusSettings{"socketcan", true, false, 0.02}, stop_);
  (void)backend_->connect();
  emulator_.command("turn 10000 2");
  try {
    backend_->open(frame());
    FAIL() << "started";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("was turned while the drives were being enabled"));
  }
  for (std::uint8_t node = 1; node <= 3; ++node) {
    EXPECT_EQ(awaited_by(node), 0x7F'7530u);
    EXPECT_FALSE(is_powered(state_of_node(node)));
  }
}

TEST_F(WatchingDrives, AreRefusedWhereTheyCannotWatch) {
  emulator_.command("abort 06020000 1");
  EXPECT_THAT(refused().what(), HasSubstr("node 1: cannot await a heartbeat (no 1016h:1): set watch_ms = 0"));
  settings_.watch_ms = 20;
  settings_.loop_ns = 20'000'000;
  EXPECT_THAT(refused().what(), HasSubstr("watch_ms = 20 is too short"));
}

}  // namespace
}  // namespace corbot::rt
