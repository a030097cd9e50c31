// SPDX-License-Identifier: Apache-2.0
// The thread between the cycle and a bus: newest wins, losses, the way back.
#include "unit/backends/fake_bus.h"

#include <cmath>

namespace corbot::rt {
namespace {

TEST_F(BusBackendTest, ApproachesFirstAndThenSendsTheNewest) {
  const auto backend = make();
  EXPECT_EQ(backend->health(), BackendHealth::kClosed);
  backend->open(frame(1));
  EXPECT_EQ(backend->health(), BackendHealth::kOpen);
  EXPECT_EQ(to_string(backend->drain_log()), "a fake device");
  EXPECT_EQ(to_string(backend->drain_log()), "");
  for (std::uint64_t cycle = 2; cycle <= 1000; ++cycle) backend->write(frame(cycle));
  EXPECT_TRUE(wait_until([&] { return newest_sent() == 1000; }));
  const auto sent = bus_.copy();
  EXPECT_EQ(sent.front(), std::make_pair(std::uint64_t{1}, true));
  EXPECT_LT(sent.size(), 500u) << "what is overtaken is skipped, not queued";
  std::uint64_t last = 0;
  for (std::size_t i = 1; i < sent.size(); ++i) {
    EXPECT_FALSE(sent[i].second);
    EXPECT_GE(sent[i].first, last);
    last = sent[i].first;
  }
  backend->close();
  backend->close();
  EXPECT_EQ(backend->health(), BackendHealth::kClosed);
  EXPECT_EQ(bus_.closed, 1);
  EXPECT_EQ(bus_.relaxed, 0);
}

TEST_F(BusBackendTest, AsksWhereTheServosAreBeforeItMovesAnything) {
  bus_.reported_us = {1200.0, 1700.0};
  const auto backend = make();
  const DevicePosition position = backend->connect();
  EXPECT_EQ(position.kind, DevicePosition::Kind::kCommanded);
  EXPECT_NEAR(position.position_q[0], 0.5, 1e-12);
  EXPECT_NEAR(position.opening, 0.25, 1e-12);
  EXPECT_TRUE(bus_.copy().empty());
  backend->open(frame(1));
  EXPECT_EQ(bus_.opened, 1) << "once";
  backend->close();
  EXPECT_EQ(bus_.closed, 1);
}

TEST_F(BusBackendTest, AControllerThatHasSentNoPulseTellsNothing) {
  for (const double never_us : {0.0, 500.0, 2550.0}) {
    bus_.reported_us = {1200.0, never_us};
    EXPECT_EQ(make()->connect().kind, DevicePosition::Kind::kUnknown) << never_us;
  }
  bus_.reported_us = {1200.0, 1700.0};
  EXPECT_EQ(make(false, true)->connect().kind, DevicePosition::Kind::kUnknown) << "servos without pulses";
  EXPECT_EQ(bus_.closed, bus_.opened) << "one that was never served is closed, too";
}

TEST_F(BusBackendTest, EncodersMeasure) {
  bus_.has_encoders = true;
  bus_.reported_us = {0.7};
  const DevicePosition position = make(false, true)->connect();
  EXPECT_EQ(position.kind, DevicePosition::Kind::kMeasured);
  EXPECT_EQ(position.position_q[0], 0.7);
  EXPECT_LT(position.opening, 0.0);
}

TEST_F(BusBackendTest, SaysAtOnceThatADeviceIsMissing) {
  bus_.there = false;
  const auto backend = make();
  EXPECT_THROW(backend->open(frame(1)), DeviceError);
}

TEST_F(BusBackendTest, IsLostTriesAgainAndApproachesBeforeItIsOpen) {
  const auto backend = make();
  backend->open(frame(1));
  bus_.there = false;
  bus_.fails = true;
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; }));
  EXPECT_EQ(backend->cause(), DeviceCause::kHungUp);
  EXPECT_THAT(to_string(backend->drain_log()), ::testing::HasSubstr("lost: /dev/fake: cut"));
  bus_.fails = false;
  const std::size_t before = bus_.copy().size();
  bus_.there = true;
  const std::uint64_t cleared = clear(*backend, frame(76));
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_EQ(backend->cause(), DeviceCause::kNone);
  EXPECT_EQ(bus_.opened, 2);
  EXPECT_EQ(bus_.copy().at(before), std::make_pair(cleared, true));
}

TEST_F(BusBackendTest, FiftyLossesLeaveNothingHanging) {
  const auto backend = make(true);
  backend->open(frame(1));
  for (int i = 0; i < 50; ++i) {
    bus_.fails = true;
    ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; })) << i;
    EXPECT_FALSE(backend->read().commanded) << "nothing stale";
    bus_.fails = false;
    (void)clear(*backend, frame(static_cast<std::uint64_t>(10 * i + 10)));
    ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; })) << i;
  }
  backend->close();
  EXPECT_EQ(bus_.closed, bus_.opened);
}

TEST_F(BusBackendTest, WhatAControllerSendsIsNotMeasured) {
  const auto backend = make(true);
  backend->open(frame(1, 1200.0));
  backend->write(frame(2, 1200.0));
  ASSERT_TRUE(wait_until([&] { return backend->read().commanded; }));
  EXPECT_FALSE(backend->read().measured);
  EXPECT_NEAR(backend->read().position_q[0], 0.5, 1e-12);
}

/// A backend measures the joints even if no caller has asked for it: the goal reached and the following error
/// come from the encoders.
TEST_F(BusBackendTest, EncodersMeasureTheJoints) {
  bus_.is_drive = bus_.has_encoders = true;
  bus_.approach_ns = 0;
  bus_.reported_us = {0.25};
  const auto backend = make(false);
  ServoFrame first = frame(1, 0.25);
  first.position_q[0] = 0.25;
  backend->open(first);
  ASSERT_TRUE(wait_until([&] { return backend->read().measured; }));
  EXPECT_FALSE(backend->read().commanded);
  EXPECT_NEAR(backend->read().position_q[0], 0.25, 1e-12);
}

TEST_F(BusBackendTest, ALossIsSaidBeforeTheDeviceIsClosed) {
  const auto backend = make(true);
  backend->open(frame(1));
  bus_.blocks_close = true;
  bus_.fails = true;
  EXPECT_TRUE(becomes(*backend, BackendHealth::kLost));
  EXPECT_THAT(to_string(backend->drain_log()), ::testing::HasSubstr("lost: ")) << "without its cause";
  EXPECT_EQ(bus_.closed, 0);
  bus_.blocks_close = false;
  EXPECT_TRUE(wait_until([&] { return bus_.closed > 0; }));
}

TEST_F(BusBackendTest, AMissingAnswerDegradesAndThreeInARowAreALoss) {
  const auto backend = make(true);
  backend->open(frame(1));
  // By the log: what passes in some milliseconds may pass unseen.
  std::string log = to_string(backend->drain_log());
  const auto is_logged = [&](const char* text) {
    return wait_until([&] {
      log += to_string(backend->drain_log()) + "\n";
      return log.find(text) != std::string::npos;
    });
  };
  bus_.misses = 2;
  EXPECT_TRUE(is_logged("degraded: /dev/fake: no answer")) << log;
  EXPECT_TRUE(is_logged("answers again")) << log << "after many good ones";
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_EQ(backend->cause(), DeviceCause::kNone);
  EXPECT_EQ(bus_.opened, 1);
  bus_.misses = 3;
  EXPECT_TRUE(is_logged("lost: /dev/fake: no answer")) << log;
  (void)clear(*backend, frame(10));
  ASSERT_TRUE(wait_until([&] { return bus_.opened == 2 && backend->health() == BackendHealth::kOpen; }));
}

TEST_F(BusBackendTest, LeadsADeviceThatDoesNotInterpolate) {
  bus_.approach_ns = 0;
  const auto backend = make();
  backend->open(frame(1, 1500.0));
  bus_.fails = true;
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; }));
  const std::size_t before = bus_.copy().size();
  bus_.fails = false;
  (void)clear(*backend, frame(2, 1490.0));
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  const std::lock_guard lock(bus_.mutex);
  ASSERT_GT(bus_.pulses_us.size(), before + 20) << "25 ms at 400 us/s, a frame a millisecond";
  for (std::size_t i = std::max<std::size_t>(before, 1); i < bus_.pulses_us.size(); ++i) {
    EXPECT_LE(std::abs(bus_.pulses_us[i] - bus_.pulses_us[i - 1]), 0.4 + 1e-9) << i;
  }
  EXPECT_EQ(bus_.pulses_us.back(), 1490.0);
}

TEST_F(BusBackendTest, TellsOfTheDevicesEmergencyStop) {
  const auto backend = make();
  backend->open(frame(1));
  EXPECT_EQ(stop_.sources(), 0u);
  bus_.pressed = true;
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == static_cast<std::uint32_t>(StopSource::kDevice); }));
  bus_.pressed = false;
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
}

TEST_F(BusBackendTest, AnEmergencyStopHaltsAnApproachUntilItIsCleared) {
  const auto backend = make();
  backend->open(frame(1));
  bus_.approach_ns = 20'000'000'000;
  lose(*backend);
  bus_.fails = false;
  const std::uint64_t cleared = clear(*backend, frame(2));
  ASSERT_TRUE(wait_until([&] { return approaches() == 2; })) << "under way";
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  bus_.pressed = true;
  ASSERT_TRUE(wait_until([&] { return bus_.halted == 1; }));
  const std::size_t before = bus_.copy().size();
  bus_.pressed = false;
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  int asked = bus_.asked;
  ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + 10; }));
  EXPECT_EQ(bus_.copy().size(), before) << "released, and the cycle has said nothing of it yet";
  backend->write(stopped(cleared + 3));
  asked = bus_.asked;
  ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + 10; }));
  EXPECT_EQ(bus_.copy().size(), before) << "released, not cleared";
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  bus_.approach_ns = 2'000'000;
  backend->write(frame(cleared + 4));
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_EQ(bus_.copy().at(before), std::make_pair(cleared + 4, true));
  EXPECT_EQ(bus_.halted, 1);
}

TEST_F(BusBackendTest, DoesNotBeginWithThePressedStop) {
  bus_.pressed = true;
  const auto backend = make();
  EXPECT_THROW(backend->open(frame(1)), DeviceError);
  EXPECT_TRUE(bus_.copy().empty());
  EXPECT_EQ(bus_.closed, 1);
}

TEST_F(BusBackendTest, AnEndDuringAnApproachSendsNothingMore) {
  const auto backend = make();
  backend->open(frame(1));
  bus_.approach_ns = 20'000'000'000;
  lose(*backend);
  bus_.fails = false;
  (void)clear(*backend, frame(2));
  ASSERT_TRUE(wait_until([&] { return approaches() == 2; })) << "under way";
  backend->close();
  EXPECT_EQ(bus_.halted, 1);
  EXPECT_TRUE(bus_.copy().back().second);
  EXPECT_EQ(approaches(), 2);
}

/// For a watchdog output.
TEST_F(BusBackendTest, BeatsUnlessACallToTheDeviceDoesNotReturn) {
  const auto backend = make();
  EXPECT_EQ(backend->beats(), 0u) << "no thread yet";
  const auto advances = [&] {
    const std::uint32_t before = backend->beats();
    return wait_until([&] { return backend->beats() > before + 5; });
  };
  backend->open(frame(1));
  EXPECT_TRUE(advances());
  {
    const std::lock_guard lock(bus_.mutex);  // which the device's send() waits for
    EXPECT_TRUE(wait_until([&] {
      const std::uint32_t before = backend->beats();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      return backend->beats() == before;
    }));
  }
  EXPECT_TRUE(advances());
  bus_.there = false;
  bus_.fails = true;
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; }));
  EXPECT_TRUE(advances()) << "while it tries again";
}

TEST_F(BusBackendTest, RelaxesAtTheEndWhereAskedTo) {
  const auto backend = make(false, true);
  backend->open(frame(1));
  backend->close();
  EXPECT_EQ(bus_.relaxed, 1);
}

}  // namespace
}  // namespace corbot::rt
