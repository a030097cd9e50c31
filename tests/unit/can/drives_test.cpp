// SPDX-License-Identifier: Apache-2.0
// The backend and emulated drives on one bus: from power-up to the end, and everything that may go wrong.
#include <algorithm>
#include <csignal>
#include <thread>

#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

/// BusBackend approaches at 0.5 rad/s in steps of a millisecond, rounded. A late step may have the size of
/// two.
constexpr std::int64_t kLargestStep = 2 * 25 + 2;

TEST_F(Drives, AreEnabledWhereTheyStandAndFollow) {
  open();
  EXPECT_THAT(log_, HasSubstr("nodes 1, 2, 3 (corbot emulated drive); 1000.0 frames a second"));
  EXPECT_TRUE(arrives());
  EXPECT_TRUE(wait_until(within(10), [&] {
    const ServoFeedback feedback = backend_->read();
    return feedback.measured && std::abs(feedback.position_q[0] - 0.25) < 1e-9 &&
           feedback.position_q[1] == 0.0;
  }));
  EXPECT_TRUE(arrives(12'520));
  EXPECT_EQ(backend_->health(), BackendHealth::kOpen);
  EXPECT_LE(emulator_.largest_steps(kStandsAt).first, kLargestStep);
}

TEST_F(Drives, CatchUpNoFasterThanTheyMay) {
  constexpr double kMost_per_s = 60'000.0;
  for (JointLimits& joint : arm_.joints) joint.speed_q_s = 0.5 * kMost_per_s / kCountsPerRad;
  open();
  ASSERT_TRUE(arrives());
  EXPECT_TRUE(arrives(15'000)) << "a set-point that is late by many cycles";
  backend_->close();
  EXPECT_EQ(emulator_.stop(), 0);
  EXPECT_LE(emulator_.largest_steps(kStandsAt).first, std::lround(kMost_per_s * 1e-3));
}

TEST_F(Drives, AreLostByAFaultAndComeBack) {
  open();
  ASSERT_TRUE(arrives());
  emulator_.command("emcy 3210 2");
  expect_lost(DeviceCause::kDeviceFault, "EMCY 0x3210 (DC link over-voltage)");
  ASSERT_TRUE(clear()) << log_;
  EXPECT_TRUE(arrives());
}

TEST_F(Drives, AreLostWhenOneFallsSilent) {
  open();
  emulator_.command("silent on 2");
  expect_lost(DeviceCause::kHeartbeatLost, "node 2: no heartbeat");
  EXPECT_FALSE(backend_->read().measured);
  emulator_.command("silent off 2");
  ASSERT_TRUE(clear()) << log_;
  EXPECT_TRUE(arrives());
}

TEST_F(Drives, AreLostWhenOneFallsSilentHoweverRarelyFramesAreRead) {
  settings_.heartbeat_ms = 10;
  settings_.loop_ns = arm_.period_ns = 20'000'000;
  open(false, false);
  emulator_.command("silent on 2");
  expect_lost(DeviceCause::kHeartbeatLost, "node 2: no heartbeat");
}

TEST_F(Drives, AreStartedWithASlowHeartbeat) {
  settings_.heartbeat_ms = 2'500;
  open();
  EXPECT_TRUE(arrives());
}

TEST_F(Drives, MayAnswerTheFirstSyncLateAfterASlowStart) {
  settings_.heartbeat_ms = 2'500;
  Cia402Drives drives(settings_);
  emulator_.command("mute on 2");
  drives.open();
  EXPECT_EQ(drives.measure(frame()).unit, BusReading::Unit::kNothing);
  emulator_.command("mute off 2");
  EXPECT_TRUE(
      wait_until(within(10), [&] { return drives.measure(frame()).unit == BusReading::Unit::kJoints; }));
}

TEST_F(Drives, KeepAWarningThatStandsAtTheirStart) {
  CanPort port;
  port.open(emulator_.bus(), {kRpdo1 + 1});
  Cia402Drives drives(settings_);
  std::jthread warns([&] {
    if (port.read(CanPort::Clock::now() + std::chrono::seconds(10))) emulator_.command("emcy 8120 3");
  });
  drives.open();
  (void)drives.energise([] { return false; });
  warns.join();
  EXPECT_TRUE(wait_until(within(10), [&] {
    drives.send(frame(), false);
    (void)drives.measure(frame());
    const auto warning = drives.warning();
    return warning && std::string(warning->what()).find("node 3: EMCY 0x8120") != std::string::npos;
  }));
}

TEST_F(Drives, AreLostWhenOneSendsHeartbeatsOnly) {
  open();
  emulator_.command("mute on 2");
  expect_lost(DeviceCause::kHeartbeatLost, "node 2 sends no process data");
  emulator_.command("mute off 2");
  ASSERT_TRUE(clear()) << log_;
  EXPECT_TRUE(arrives());
}

TEST_F(Drives, ReportNoOldPositions) {
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
  const auto measures = [&] {
    drives.send(frame(), false);
    return drives.measure(frame()).unit != BusReading::Unit::kNothing;
  };
  ASSERT_TRUE(wait_until(within(10), measures));
  emulator_.command("mute on 2");
  EXPECT_TRUE(wait_until(within(10), [&] { return !measures(); }));
  emulator_.command("mute off 2");
  EXPECT_TRUE(wait_until(within(10), measures));
}

TEST_F(Drives, AreNotStartedBeforeAllHaveSaidWhereTheyAre) {
  emulator_.command("mute on 2");
  backend_ = std::make_unique<BusBackend>(arm_, std::make_unique<Cia402Drives>(settings_),
                                          BusSettings{"socketcan", true, false, 0.02}, stop_);
  try {
    (void)backend_->connect();
    ADD_FAILURE() << "node 2 has said nothing";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("node 2 sends no process data"));
  }
  emulator_.command("mute off 2");
  EXPECT_EQ(backend_->connect().kind, DevicePosition::Kind::kMeasured);
}

TEST_F(Drives, AreLostWhenOneRestarts) {
  open();
  emulator_.command("reset 1");
  expect_lost(DeviceCause::kDeviceFault, "node 1 has restarted");
  ASSERT_TRUE(clear()) << log_;
  EXPECT_TRUE(arrives());
}

TEST_F(Drives, AreDegradedByAWarningAsLongAsItStands) {
  open();
  emulator_.command("emcy 8120 3");
  ASSERT_TRUE(becomes(BackendHealth::kDegraded)) << log_;
  EXPECT_TRUE(wait_until(within(10), [&] {
    log_ += to_string(backend_->drain_log());
    return log_.find("node 3: EMCY 0x8120") != std::string::npos;
  })) << log_;
  EXPECT_TRUE(arrives()) << "it goes on";
  EXPECT_EQ(backend_->health(), BackendHealth::kDegraded);
  emulator_.command("emcy 0 3");
  EXPECT_TRUE(becomes(BackendHealth::kOpen)) << log_;
}

TEST_F(Drives, LiveThroughAGarbledFrame) {
  open();
  ASSERT_TRUE(arrives());
  emulator_.command("garble 1");
  ASSERT_TRUE(becomes(BackendHealth::kDegraded)) << log_;
  ASSERT_TRUE(becomes(BackendHealth::kOpen)) << log_;
  EXPECT_EQ(log_.find("lost"), std::string::npos) << log_;
}

TEST_F(Drives, ComeBackWithoutAJumpWhenTheBusIsCut) {
  if (std::getenv("CORBOT_RIG_CAN") != nullptr)
    GTEST_SKIP() << "skipped: an interface is not cut by its peer";
  open();
  ASSERT_TRUE(arrives());
  const char* times = std::getenv("CORBOT_PLUGS");
  const int rounds = times != nullptr ? std::atoi(times) : 3;
  for (int i = 0; i < rounds; ++i) {
    emulator_.command("unplug");
    expect_lost(DeviceCause::kBusDown, "the bus was cut");
    log_.clear();
    backend_->write(frame(0.252));  // where the drives do not stand when they are back
    emulator_.command("plug");
    ASSERT_TRUE(clear()) << log_;
    ASSERT_TRUE(arrives());
  }
  // Since the last return: of frames as they are written, not of the one that had waited for the bus.
  EXPECT_GT(backend_->times().age_max_ns, 0);
  backend_->close();
  EXPECT_EQ(emulator_.stop(), 0);
  EXPECT_LE(emulator_.largest_steps(kStandsAt).first, kLargestStep);
}

TEST_F(Drives, AreNotOpenedWhenOneRefuses) {
  emulator_.command("abort 08000022 2");
  const DeviceError error = refused();
  EXPECT_EQ(error.cause(), DeviceCause::kBadAnswer);
  EXPECT_EQ(std::string(error.what()), emulator_.bus() +
                                           ": node 2: reading 1000h: value cannot be transferred in the "
                                           "present state of the device (0x08000022)");
}

TEST_F(Drives, AreNotOpenedWhenOneIsMissing) {
  settings_.gripper->node = 9;
  const DeviceError error = refused();
  EXPECT_EQ(error.cause(), DeviceCause::kNoAnswer);
  EXPECT_THAT(error.what(), HasSubstr("node 9: does not answer"));
  settings_.interface = "unix:" + directory_ + "/absent";
  EXPECT_EQ(refused().cause(), DeviceCause::kNotThere);
  EXPECT_THAT(refused().what(), HasSubstr("/absent: No such file or directory"));
}

TEST_F(Drives, AreNotSentToZeroWhereTheirVoltageIsTakenOffBeforeOneHasSaidWhereItIs) {
  Cia402Drives before(settings_);
  before.open();
  (void)before.energise([] { return false; });
  emulator_.command("unplug");
  before.close();
  emulator_.command("plug");
  emulator_.command("mute on 3");
  Cia402Drives drives(settings_);
  drives.open();
  std::jthread answers([this] { emulator_.command("mute off 3"); });
  (void)drives.de_energise();
  EXPECT_LE(emulator_.largest_steps(kStandsAt).first, kLargestStep);
  drives.close();
}

TEST_F(Drives, AreDisabledAgainWhenOneCannotBeEnabled) {
  emulator_.command("sto on 2");
  EXPECT_THAT(refused().what(), HasSubstr("node 2 cannot be enabled, it is in 'switch on disabled'"));
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(state_of_node(3), DriveState::kSwitchOnDisabled);
  emulator_.command("sto off 2");
  open();
  backend_->close();
  emulator_.command("sto on 2");
  EXPECT_EQ(refused().cause(), DeviceCause::kTorqueOff);
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled) << "it has held its load before";
}

TEST_F(Drives, SayWhyTheyCannotBeEnabledAlsoOnABusThatAcceptsNothingForAMoment) {
  if (std::getenv("CORBOT_RIG_CAN") != nullptr)
    GTEST_SKIP() << "skipped: a kernel's interface accepts frames while its peer stands";
  emulator_.command("sto on 2");
  Cia402Drives drives(settings_);
  drives.open();
  std::jthread goes_on;
  try {
    (void)drives.energise([&] {
      if (!goes_on.joinable()) {
        emulator_.signal(SIGSTOP);
        goes_on = std::jthread([this] {
          std::this_thread::sleep_for(std::chrono::milliseconds(400));
          emulator_.signal(SIGCONT);
        });
      }
      return false;
    });
    ADD_FAILURE() << "node 2 was enabled";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kTorqueOff) << error.what();
  }
}

TEST_F(Drives, AreNotEnabledWhereTwoHaveOneNumber) {
  if (std::getenv("CORBOT_RIG_CAN") != nullptr)
    GTEST_SKIP() << "skipped: on a kernel's interface the second drive comes too late";
  emulator_.command("sto on 1");  // so that enabling lasts until the second one has been heard
  CanPort port;
  listen(port, {kSync});
  std::jthread second([&](const std::stop_token& end) {
    CanFrame answer{};  // 'switch on disabled', elsewhere
    answer.can_id = kTpdo1 + 1;
    answer.can_dlc = 6;
    const auto count = static_cast<std::uint32_t>(2 * kStandsAt);
    answer.data[0] = 0x40;
    for (std::size_t i = 0; i < 4; ++i) answer.data[2 + i] = static_cast<std::uint8_t>(count >> (8 * i));
    while (!end.stop_requested()) {
      if (port.read(CanPort::Clock::now() + std::chrono::milliseconds(20)))
        port.write(answer, CanPort::Clock::now() + std::chrono::seconds(10));
    }
  });
  const DeviceError error = refused();
  EXPECT_EQ(error.cause(), DeviceCause::kBadAnswer);
  EXPECT_THAT(error.what(), HasSubstr("node 1 reports positions that are 12000 counts apart, one after the "
                                      "other: was it moved, or do two drives have this number?"));
  second.request_stop();
  second.join();
  EXPECT_EQ(emulator_.largest_steps(kStandsAt).second, 0) << "no shaft moved";
}

TEST_F(Drives, AreEnergisedAndDeEnergisedWhenAsked) {
  Cia402Drives drives(settings_);
  drives.open();
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled);
  const auto measured_q = [&] {
    const BusReading reading = drives.measure(frame());
    return reading.unit == BusReading::Unit::kJoints ? reading.value[0] : HUGE_VAL;
  };
  EXPECT_TRUE(wait_until(within(10), [&] { return measured_q() == kStandsAt / kCountsPerRad; }));
  (void)drives.energise([] { return false; });
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled);
  drives.send(frame(kStandsAt / kCountsPerRad), false);
  EXPECT_TRUE(drives.de_energise());
  for (std::uint8_t node = 1; node <= 3; ++node)
    EXPECT_EQ(state_of_node(node), DriveState::kSwitchOnDisabled);
  EXPECT_TRUE(wait_until(within(10), [&] { return measured_q() == kStandsAt / kCountsPerRad; }));
  EXPECT_EQ(state_of_node(1), DriveState::kSwitchOnDisabled) << "SYNC enables nothing";
  (void)drives.energise([] { return false; });
  EXPECT_EQ(state_of_node(2), DriveState::kOperationEnabled);
}

TEST_F(Drives, AreEnabledOneAfterAnother) {
  settings_.stagger_ms = 300;
  CanPort port;
  port.open(emulator_.bus(), {kRpdo1 + 1, kRpdo1 + 2, kRpdo1 + 3});
  std::vector<std::pair<int, int>> seen;  // node, the first of each of these controlwords
  std::jthread reads([&](const std::stop_token& end) {
    for (;;) {
      const auto got = port.read(CanPort::Clock::now() + std::chrono::milliseconds(10));
      if (!got && end.stop_requested()) return;
      if (!got) continue;
      const std::pair<int, int> step{static_cast<int>(got->can_id - kRpdo1), got->data[0]};
      if (step.second != kShutDown && step.second != kEnableOperation) continue;
      if (std::find(seen.begin(), seen.end(), step) == seen.end()) seen.push_back(step);
    }
  });
  Cia402Drives drives(settings_);
  drives.open();
  const auto begin = CanPort::Clock::now();
  ASSERT_TRUE(drives.energise([] { return false; }));
  EXPECT_GE(CanPort::Clock::now() - begin, std::chrono::milliseconds(600));
  for (std::uint8_t node = 1; node <= 3; ++node)
    EXPECT_EQ(state_of_node(node), DriveState::kOperationEnabled);
  await_bus();
  reads.request_stop();
  reads.join();
  EXPECT_THAT(seen, ::testing::ElementsAre(std::pair(1, 0x06), std::pair(1, 0x0F), std::pair(2, 0x06),
                                           std::pair(2, 0x0F), std::pair(3, 0x06), std::pair(3, 0x0F)));
}

TEST_F(Drives, AreServedAsFastAsTheBusAllows) {
  settings_.bit_rate = 500'000;
  open();
  EXPECT_THAT(
      log_,
      HasSubstr(
          "500.0 frames a second, which need 466 kbit/s of 500 kbit/s; the loop's 1000 would need 932"));
  EXPECT_TRUE(arrives());
  backend_.reset();
  settings_.bit_rate = 5'000;
  EXPECT_THAT(refused().what(), HasSubstr("5 kbit/s cannot carry 3 drives"));
}

TEST_F(Drives, ExplainTheirFaultsToAPerson) {
  emulator_.command("help");
  const std::string said = emulator_.output();
  for (const char* word :
       {"sto on|off [NODE]", "turn COUNTS [NODE]", "writable OBJECT", "abort CODE [OBJECT] [NODE]"}) {
    EXPECT_THAT(said, HasSubstr(word));
  }
}

TEST_F(Drives, AnswerNoRequestThatIsMadeLater) {
  constexpr ObjectAddress kMode{0x6060};
  std::array<CanPort, 2> ports;
  for (CanPort& port : ports) port.open(emulator_.bus(), {kSdoAnswer + 1});
  std::array<DriveWatch, 2> watches{DriveWatch({1}), DriveWatch({1})};
  SdoClient mine(ports[0], watches[0], 1);
  SdoClient others(ports[1], watches[1], 1);
  others.write(kMode, 0, 1);
  EXPECT_EQ(others.read(kMode), 0u);  // all on the bus hear that
  others.write(kMode, 8, 1);
  EXPECT_EQ(mine.read(kMode), 8u);
}

TEST_F(Drives, HoldOrRelaxAtTheEnd) {
  open(false);
  backend_->close();
  EXPECT_EQ(state_of_node(1), DriveState::kOperationEnabled);
  open(true);
  backend_->close();
  // The emulator may receive this test's query before the backend's last frame.
  EXPECT_TRUE(wait_until(within(10), [&] { return state_of_node(1) == DriveState::kSwitchOnDisabled; }));
}

}  // namespace
}  // namespace corbot::rt
