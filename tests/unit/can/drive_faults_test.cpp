// SPDX-License-Identifier: Apache-2.0
// Drives that leave operation, lose their torque, do not follow, or get no set-points any more.
#include <thread>
#include <utility>

#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class FailingDrives : public Drives {
 protected:
  /// Exchanges frames until the drives are lost; `still`: the cycle stands still, else it goes on.
  std::optional<DeviceError> fails(Cia402Drives& drives, bool still = false) {
    const ServoFrame last = frame();
    std::optional<DeviceError> failure;
    EXPECT_TRUE(wait_until(within(30), [&] {
      try {
        const ServoFrame next = still ? last : frame();
        drives.send(next, false);
        (void)drives.measure(next);
        return false;
      } catch (const DeviceError& error) {
        failure = error;
        return true;
      }
    }));
    return failure;
  }
  void serve(Cia402Drives& drives, int frames) {
    for (int i = 0; i < frames; ++i) {
      drives.send(frame(), false);
      (void)drives.measure(frame());
    }
  }
  bool comes_to(std::uint8_t node, DriveState state) {
    return wait_until(within(30), [&] { return state_of_node(node) == state; });
  }
  void expect_failure(const std::string& command, DeviceCause cause, const std::string& text) {
    Cia402Drives drives(settings_);
    drives.open();
    (void)drives.energise([] { return false; });
    serve(drives, 20);
    emulator_.command(command);
    const auto failure = fails(drives);
    ASSERT_TRUE(failure);
    EXPECT_EQ(failure->cause(), cause) << failure->what();
    EXPECT_THAT(failure->what(), HasSubstr(text));
    drives.close();
  }
  /// While the first one is enabled and the last one waits for its turn; what has passed by then counts as
  /// well.
  void expect_not_enabled_after(const std::string& begin, const std::string& end, DeviceCause cause) {
    settings_.stagger_ms = 1000;
    Cia402Drives drives(settings_);
    drives.open();
    int looks = 0;
    try {
      (void)drives.energise([&] {
        if (++looks == 10) emulator_.command(begin);
        if (looks == 30) emulator_.command(end);
        return looks > 100'000;
      });
      FAIL() << "enabled";
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.cause(), cause) << error.what();
      EXPECT_THAT(error.what(), HasSubstr("node 3 cannot be enabled"));
    }
    for (std::uint8_t node = 1; node <= 2; ++node) EXPECT_TRUE(comes_to(node, DriveState::kSwitchOnDisabled));
  }
};

TEST_F(FailingDrives, AreLostBySafeTorqueOff) {
  expect_failure("sto on 2", DeviceCause::kTorqueOff,
                 "node 2, now 'switch on disabled', has safe torque off, or no voltage");
}

TEST_F(FailingDrives, AreLostWhenOneLeavesOperation) {
  expect_failure("disable 2", DeviceCause::kDisabled,
                 "node 2, now 'switch on disabled', has left 'operation enabled' without a command");
}

TEST_F(FailingDrives, AreLostWhenOneIgnoresItsTargets) {
  expect_failure("ignore on 2", DeviceCause::kTargetIgnored,
                 "node 2 does not follow its target positions (statusword bit 12 is 0)");
}

TEST_F(FailingDrives, AreNotEnabledWhenOneIgnoresItsTargets) {
  emulator_.command("ignore on 1");
  EXPECT_THAT(refused().what(), HasSubstr("node 1 does not follow its target positions"));
  EXPECT_EQ(state_of_node(2), DriveState::kSwitchOnDisabled);
  settings_.joints[0].reports_following = false;
  open();
  EXPECT_EQ(backend_->health(), BackendHealth::kOpen) << "as a drive without this bit";
}

TEST_F(FailingDrives, AreNotEnabledWhenOneLosesItsTorqueBeforeItsTurn) {
  expect_not_enabled_after("sto on 3", "sto off 3", DeviceCause::kTorqueOff);
}

TEST_F(FailingDrives, AreNotEnabledWhenOneHasAFaultBeforeItsTurn) {
  expect_not_enabled_after("emcy 3210 3", "emcy 0 3", DeviceCause::kDeviceFault);
}

TEST_F(FailingDrives, AreNotEnabledWhenOneLeavesOperationBeforeTheLastHasItsTurn) {
  settings_.stagger_ms = 1000;
  Cia402Drives drives(settings_);
  drives.open();
  int looks_in_operation = 0;  // the second comes after a SYNC in which it said so
  try {
    (void)drives.energise([&] {
      if (looks_in_operation == 3 || state_of_node(1) != DriveState::kOperationEnabled) return false;
      if (++looks_in_operation == 3) emulator_.command("disable 1");
      return false;
    });
    FAIL() << "enabled";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kDisabled) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("node 1 cannot be enabled"));
  }
}

TEST_F(FailingDrives, StopTheOthersWhenOneFails) {
  expect_failure("disable 2", DeviceCause::kDisabled, "node 2");
  for (std::uint8_t node = 1; node <= 3; ++node) EXPECT_TRUE(comes_to(node, DriveState::kSwitchOnDisabled));
}

TEST_F(FailingDrives, StopByThemselvesOnARampWhenNoSetPointComes) {
  settings_.stale_ns = 50'000'000;
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  serve(drives, 20);
  const auto failure = fails(drives, true);
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->cause(), DeviceCause::kNoSetpoint);
  EXPECT_THAT(failure->what(), HasSubstr("no set-point for 50 ms: the drives are stopped (quick stop)"));
  CanPort port;
  listen(port, {kRpdo1 + 1});
  drives.close();
  await_bus();
  std::vector<std::uint16_t> words;
  while (const auto sent = port.read(CanPort::Clock::time_point{})) {
    words.push_back(static_cast<std::uint16_t>(little_endian(*sent, 0, 2)));
  }
  ASSERT_GE(words.size(), 2u);
  EXPECT_EQ(words.front(), kQuickStop);
  EXPECT_EQ(words.back(), kDisableVoltage);
  EXPECT_TRUE(comes_to(1, DriveState::kSwitchOnDisabled));
}

TEST_F(FailingDrives, AreStoppedWithTheirLastTargets) {
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  serve(drives, 20);
  emulator_.command("block on 1");  // its position stays behind
  ServoFrame ahead = frame();
  ahead.position_q[0] += 0.01;
  drives.send(ahead, false);
  (void)drives.measure(ahead);
  CanPort port;
  listen(port, {kRpdo1 + 1});
  drives.send(ahead, false);
  const auto sent = port.read(CanPort::Clock::now() + std::chrono::seconds(30));
  ASSERT_TRUE(sent);
  const auto target = little_endian(*sent, 2, 4);
  emulator_.command("emcy 3210 2");
  std::optional<DeviceError> failure;
  EXPECT_TRUE(wait_until(within(30), [&] {
    try {
      drives.send(ahead, false);
      (void)drives.measure(ahead);
    } catch (const DeviceError& error) {
      failure = error;
    }
    return failure.has_value();
  }));
  drives.close();
  await_bus();
  int stops = 0;
  while (const auto next = port.read(CanPort::Clock::time_point{})) {
    EXPECT_EQ(little_endian(*next, 2, 4), target);
    if (little_endian(*next, 0, 2) != kEnableOperation) ++stops;
  }
  EXPECT_GE(stops, 2) << "quick stop, and voltage off";
}

TEST_F(FailingDrives, GetTheirVoltageOffAlsoWhenAQuickStopKeepsIt) {
  emulator_.command("store 605A 6");
  expect_failure("disable 2", DeviceCause::kDisabled, "node 2");
  EXPECT_TRUE(comes_to(1, DriveState::kSwitchOnDisabled));
}

TEST_F(FailingDrives, HearNoHeartbeatWhileTheCycleStandsStill) {
  settings_.stale_ns = 50'000'000;
  settings_.watch_ms = 5'000;  // longer than a machine may stand still
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  serve(drives, 20);
  EXPECT_TRUE(drives.de_energise());
  CanPort port;
  port.open(emulator_.bus(), {kHeartbeat + kMasterNode, kEmergency + 1});
  const ServoFrame last = frame();
  EXPECT_TRUE(wait_until(within(30), [&] {
    (void)drives.measure(last);  // goes on, and sends no heartbeat after a while
    while (const auto heard = port.read(CanPort::Clock::time_point{})) {
      if (heard->can_id == kEmergency + 1) return little_endian(*heard, 0, 2) == 0x8130u;
    }
    return false;
  }));
}

TEST_F(FailingDrives, AreMeasuredWithoutEnergyAndStayWhereTheyWereTurned) {
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  serve(drives, 20);
  EXPECT_TRUE(drives.de_energise());
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
  emulator_.command("sto on 1");
  emulator_.command("turn -500 1");
  emulator_.command("sto off 1");
  const auto at_q = [&] { return drives.measure(frame()).value[0]; };
  const double before = emulator_.counts().at(1) / kCountsPerRad;
  EXPECT_TRUE(wait_until(within(30), [&] { return std::abs(at_q() - before) < 1e-9; }));
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
  (void)drives.energise([] { return false; });
  for (int i = 0; i < 50; ++i) (void)at_q();
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled);
  EXPECT_DOUBLE_EQ(emulator_.counts().at(1) / kCountsPerRad, before) << "enabled where it stands";
}

TEST_F(FailingDrives, HaveAFaultResetOnceOnly) {
  Cia402Drives drives(settings_);
  drives.open();
  emulator_.command("emcy 3210 2");
  emulator_.command("sto on 3");  // else all could be enabled before the fault is back
  CanPort port;
  port.open(emulator_.bus(), {kRpdo1 + 2, kTpdo1 + 2});
  int resets = 0;
  std::jthread returns([&](const std::stop_token& end) {
    std::uint32_t last = 0;
    bool is_faulty = true;
    while (!end.stop_requested()) {
      const auto sent = port.read(CanPort::Clock::now() + std::chrono::milliseconds(10));
      if (!sent) continue;
      const std::uint32_t word = little_endian(*sent, 0, 2);
      if (sent->can_id == kRpdo1 + 2) {
        if ((word & kFaultReset) != 0 && (last & kFaultReset) == 0) ++resets;
        last = word;
        continue;
      }
      // A fault whose cause stays: it is back when the reset has taken effect, which is with a SYNC after it.
      const bool was_faulty =
          std::exchange(is_faulty, state_of(static_cast<std::uint16_t>(word)) == DriveState::kFault);
      if (was_faulty && !is_faulty) emulator_.command("emcy 3210 2");
    }
  });
  try {
    (void)drives.energise([] { return false; });
    FAIL() << "enabled";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kDeviceFault);
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("node 2 cannot be enabled, it is in 'fault"),
                                             HasSubstr("EMCY 0x3210")));
  }
  returns.request_stop();
  returns.join();
  EXPECT_EQ(resets, 1);
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
}

/// Counted in SYNCs: a time would be this machine's.
TEST_F(FailingDrives, WaitForNoSilentOneOnASlowBusWithTheirVoltage) {
  Cia402Drives before(settings_);
  before.open();
  (void)before.energise([] { return false; });
  before.close();
  settings_.loop_ns = 100'000'000;
  emulator_.command("mute on 3");
  Cia402Drives drives(settings_);
  drives.open();
  CanPort port;
  listen(port, {kRpdo1 + 1, kRpdo1 + 3, kSync});
  EXPECT_THROW((void)drives.de_energise(), DeviceError) << "node 3 may have kept it";
  await_bus();
  int syncs = 0;
  std::map<canid_t, int> asked_before;
  while (const auto sent = port.read(CanPort::Clock::time_point{})) {
    if (sent->can_id == kSync) ++syncs;
    if (sent->can_id != kSync) asked_before.try_emplace(sent->can_id, syncs);
  }
  EXPECT_LT(asked_before[kRpdo1 + 1], asked_before[kRpdo1 + 3]);
  EXPECT_LE(asked_before[kRpdo1 + 3], 6) << "half a second";
  EXPECT_LE(syncs, 6 + 12) << "and a second";
  EXPECT_FALSE(is_powered(state_of_node(1)));
}

TEST_F(FailingDrives, ReportAMotorThatKeepsItsVoltage) {
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  serve(drives, 5);
  emulator_.command("mapping other 2");  // its words no longer arrive
  EXPECT_THROW(drives.de_energise(), DeviceError);
  drives.close();
}

}  // namespace
}  // namespace corbot::rt
