// SPDX-License-Identifier: Apache-2.0
// The way to where the cycle holds the arm, and what ends it.
#include <cmath>
#include <cstring>
#include <future>

#include "rt/backends/bus/approach.h"
#include "rt/backends/bus/bus_reading.h"
#include "unit/backends/fake_bus.h"

namespace corbot::rt {
namespace {

using BusWayTest = BusBackendTest;

/// Turned before its energy came: it is not driven back.
TEST_F(BusWayTest, ADriveIsHeldWhereItGotItsEnergyUntilSetPointsBeginThere) {
  be_drive(0.0);
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  bus_.energises_for_ever = true;
  backend->write(frame(2, 0.0));
  ASSERT_TRUE(wait_until([&] { return bus_.energised == 1; }));
  bus_.reported_us = {0.5};
  bus_.energises_for_ever = false;
  ASSERT_TRUE(wait_until([&] { return backend->read().position_q[0] == 0.5; }));
  EXPECT_TRUE(backend->read().measured);
  const int asked = bus_.asked;
  ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + 10; }));
  EXPECT_EQ(backend->health(), BackendHealth::kStandby) << "the set-points are still where it was";
  ServoFrame there = frame(3, 0.0);
  there.position_q[0] = 0.5;
  backend->write(there);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  const std::lock_guard lock(bus_.mutex);
  for (const double sent_q : bus_.positions_q) EXPECT_EQ(sent_q, 0.5);
}

/// The pulses of such a joint mean nothing to its drive: the way is not as long as theirs.
TEST_F(BusWayTest, ADriveThatIsHeldWhereTheSetPointsBeginIsOpenAtOnce) {
  be_drive(0.0);
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  backend->write(frame(2, 0.0));
  {
    const std::lock_guard lock(bus_.mutex);
    bus_.reported_us = {0.5};
  }
  ASSERT_TRUE(wait_until([&] { return backend->read().position_q[0] == 0.5; }));
  ServoFrame there = frame(3, 2000.0);
  there.position_q[0] = 0.5;
  const std::size_t sent = bus_.copy().size();
  backend->write(there);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  EXPECT_LE(bus_.copy().size(), sent + 1000) << "and not the 5 s that the pulses would take";
}

/// Under load a shaft is behind its target: to begin where it is would let the arm sink with every Clear.
TEST_F(BusWayTest, ADriveIsHeldAtTheTargetThatItWasEnergisedAt) {
  be_drive(0.5);
  bus_.lag_q = 0.02;
  const auto backend = make(true);
  ServoFrame there = stopped(1, 0.0, true);
  there.position_q[0] = 0.5;
  backend->open(there);
  there = frame(2, 0.0);
  backend->write(there);
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > 10; }));
  there.position_q[0] = backend->read().position_q[0];
  EXPECT_EQ(there.position_q[0], 0.5);
  backend->write(there);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  const std::lock_guard lock(bus_.mutex);
  for (const double sent_q : bus_.positions_q) EXPECT_EQ(sent_q, 0.5);
}

TEST_F(BusWayTest, ADriveThatIsTurnedBeyondItsRangeWhileItIsEnergisedIsSaidToBeThere) {
  arm_.joints[0].lower_q = -0.5;
  be_drive(0.0);
  bus_.lag_q = 0.6;
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  backend->write(frame(2, 0.0));  // where it is held, too
  ASSERT_TRUE(wait_until([&] { return backend->read().position_q[0] == -0.6; }));
  const std::size_t sent = bus_.copy().size();
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > sent + 10; }));
  EXPECT_EQ(backend->health(), BackendHealth::kStandby) << "the cycle answers that with an Error";
}

TEST_F(BusWayTest, ADriveThatIsTurnedWhileItIsEnergisedAtAStartIsNotStarted) {
  for (const double turned_rad : {0.04, 0.056, 0.5, -0.5}) {
    bus_.positions_q.clear();
    bus_.pulses_us.clear();
    be_drive(0.0);
    const auto backend = make(true);
    (void)backend->connect();
    bus_.reported_us = {turned_rad};
    if (turned_rad == 0.04) {
      EXPECT_NO_THROW(backend->open(frame(1, 0.0)));
    } else {
      try {
        backend->open(frame(1, 0.0));
        ADD_FAILURE() << "started";
      } catch (const DeviceError& error) {
        EXPECT_EQ(error.cause(), DeviceCause::kNone) << "no fault of the device's own";
        EXPECT_THAT(error.what(),
                    ::testing::HasSubstr(turned_rad > 0.1   ? "from 0.0 to 28.6 degrees, more than 3.0"
                                         : turned_rad > 0.0 ? "from 0.0 to 3.2 degrees, more than 3.0"
                                                            : "from 0.0 to -28.6"));
      }
      EXPECT_TRUE(bus_.positions_q.empty()) << "nothing was driven back";
      EXPECT_FALSE(bus_.is_energised) << "the program ends, and nobody is left to take it off";
    }
    backend->close();
  }
}

TEST_F(BusWayTest, AnEncoderThatDoesNotAnswerAtOnceIsAskedAgainAtAStart) {
  for (const auto& [silences, misses] : {std::pair(3, 0), std::pair(0, 1), std::pair(2, 3)}) {
    bus_.positions_q.clear();
    bus_.pulses_us.clear();
    be_drive(1.0);
    bus_.silences = silences;
    bus_.misses = misses;
    const auto backend = make(true);
    const DevicePosition found = backend->connect();
    EXPECT_EQ(found.kind, DevicePosition::Kind::kMeasured);
    EXPECT_EQ(found.position_q[0], 1.0);
    ServoFrame there = frame(1, 0.0);
    there.position_q = found.position_q;
    auto start = std::async(std::launch::async, [&] { EXPECT_NO_THROW(backend->open(there)); });
    EXPECT_EQ(start.wait_for(std::chrono::seconds(20)), std::future_status::ready) << "it hangs";
    backend->cancel();
    start.get();
  }
}

TEST_F(BusWayTest, WithoutTheEncodersPositionsNothingIsStarted) {
  be_drive(1.0);
  bus_.is_silent = true;
  const auto backend = make(true);
  EXPECT_THROW((void)backend->connect(), DeviceError);
  EXPECT_EQ(bus_.energised, 0);
  EXPECT_EQ(bus_.closed, 1);
}

TEST_F(BusWayTest, AGripperThatMeasuresIsFoundWhereItIs) {
  BusReading reading{BusReading::Unit::kJoints, {}, {}};
  EXPECT_LT(position_of(arm_, reading, true).opening, 0.0) << "unknown";
  reading.gripper_us = 1300.0;
  EXPECT_DOUBLE_EQ(position_of(arm_, reading, true).opening, 0.75);
}

TEST_F(BusWayTest, PulsesOnTheWayAreReportedToo) {
  bus_.approach_ns = 0;
  bus_.reported_us = {600.0};
  const auto backend = make();
  backend->open(stopped(1));
  ServoFeedback before;
  ASSERT_TRUE(wait_until([&] { return (before = backend->read()).commanded; }));
  backend->write(frame(2, 2500.0));
  EXPECT_TRUE(wait_until([&] {
    const ServoFeedback there = backend->read();
    return there.commanded && std::abs(there.position_q[0] - before.position_q[0]) > 0.01;
  }));
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
}

TEST_F(BusWayTest, AnApproachDoesNotReportOneWrongReading) {
  FakeDevice device(bus_);
  bus_.approach_ns = 600'000'000'000;
  bus_.is_approaching = true;
  bus_.is_at_us = 1200.0;
  bus_.garbles_every = 3;
  bus_.garbled_us = 2100.0;
  FrameSender sender(device);
  SnapshotCell<ServoFrame> cell;
  cell.store(frame(1, 2000.0));
  NewestFrame newest(cell);
  int looks = 0;
  std::vector<double> reported_us;
  Approach approach(
      arm_, device, sender, newest, std::chrono::milliseconds(0), [](const ServoFrame&) { return false; },
      [&](const BusReading& reading) { reported_us.push_back(reading.value[0]); },
      [&](auto) { return ++looks < 31; });
  EXPECT_EQ(approach.run(), Approach::Outcome::kEnd);
  EXPECT_THAT(reported_us, testing::AllOf(testing::Not(testing::IsEmpty()), testing::Each(1200.0)));
}

TEST_F(BusWayTest, AnApproachWithoutRepliesWithdrawsItsReport) {
  FakeDevice device(bus_);
  bus_.approach_ns = 600'000'000'000;
  bus_.is_approaching = true;
  bus_.is_at_us = 1200.0;
  FrameSender sender(device);
  SnapshotCell<ServoFrame> cell;
  cell.store(frame(1, 2000.0));
  NewestFrame newest(cell);
  BusReading reported;
  Clock::time_point silent_at{};
  Approach approach(
      arm_, device, sender, newest, std::chrono::milliseconds(0), [](const ServoFrame&) { return false; },
      [&](const BusReading& reading) { reported = reading; },
      [&](auto) {
        const auto now = Clock::now();
        if (bus_.is_at_us > 0.0 && reported.unit == BusReading::Unit::kPulses) {
          bus_.is_at_us = 0.0;
          silent_at = now;
        }
        return bus_.is_at_us > 0.0 ||
               (reported.unit == BusReading::Unit::kPulses && now - silent_at < std::chrono::seconds(20));
      });
  EXPECT_EQ(approach.run(), Approach::Outcome::kEnd);
  EXPECT_EQ(reported.unit, BusReading::Unit::kNothing);
  EXPECT_GE(Clock::now() - silent_at, std::chrono::milliseconds(200)) << "one missing reply is no reason";
}

/// A device that interpolates is sent to another place at once, as after a Stop on its way.
TEST_F(BusWayTest, AnApproachReportsItsPulsesAndGoesElsewhereAtOnce) {
  const auto backend = make();
  backend->open(stopped(1));
  bus_.approach_ns = 600'000'000'000;
  bus_.is_approaching = true;
  bus_.is_at_us = 1200.0;
  backend->write(frame(2, 2000.0));
  ServoFeedback there;
  ASSERT_TRUE(wait_until([&] { return (there = backend->read()).commanded && approaches() == 1; }));
  EXPECT_NEAR(there.position_q[0], 0.5, 1e-9);
  backend->write(frame(3, 1200.0));
  ASSERT_TRUE(wait_until([&] { return approaches() == 2; })) << "not first to where it was sent";
  const std::lock_guard lock(bus_.mutex);
  EXPECT_EQ(bus_.pulses_us.back(), 1200.0);
}

TEST_F(BusWayTest, WhatIsStoppedOnItsWayLosesItsEnergy) {
  be_drive(10.0);
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  backend->write(frame(2, 0.0));
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > 10; }));
  EXPECT_TRUE(bus_.is_energised);
  const int before = bus_.de_energised;
  backend->write(stopped(3, 0.0));  // as StopAndHold does, which takes no energy off
  ASSERT_TRUE(wait_until([&] { return bus_.de_energised > before; })) << "no set-points go on to hold it by";
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  const int energised = bus_.energised;
  ServoFrame here = frame(4, 0.0);
  ASSERT_TRUE(wait_until([&] {
    const ServoFeedback there = backend->read();
    here.position_q = there.position_q;
    return there.measured;
  }));
  backend->write(here);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  EXPECT_EQ(bus_.energised, energised + 1);
}

TEST_F(BusWayTest, AStartThatIsStoppedOnItsWayLeavesNoEnergy) {
  be_drive(10.0);
  const auto backend = make(true);
  auto refused =
      std::async(std::launch::async, [&] { EXPECT_THROW(backend->open(frame(1, 0.0)), DeviceError); });
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > 10; }));
  EXPECT_TRUE(bus_.is_energised);
  stop_.set(StopSource::kGpio, true);
  refused.get();
  EXPECT_FALSE(bus_.is_energised) << "the program ends, and nobody is left to take it off";
  EXPECT_EQ(bus_.closed, 1);
}

/// As a writer that is stopped in the middle of a store leaves it: the sequence, which comes first, is odd.
template <class Cell>
void begin_store(Cell& cell) {
  std::uint64_t sequence = 0;
  std::memcpy(&sequence, static_cast<const void*>(&cell), sizeof sequence);
  ++sequence;
  std::memcpy(static_cast<void*>(&cell), &sequence, sizeof sequence);
}

TEST(LastingCell, HasTheLastRecordWhileAStoreIsUnderWay) {
  LastingCell<BackendTimes> cell;
  BackendTimes times;
  EXPECT_FALSE(cell.load(times)) << "none yet";
  times.cycle = 7;
  times.speed_ratio = 0.5;
  cell.store(times);
  begin_store(cell);
  times = {};
  ASSERT_TRUE(cell.load(times));
  EXPECT_EQ(times.cycle, 7u);
  EXPECT_EQ(times.speed_ratio, 0.5);
  times.cycle = 8;
  cell.store(times);
  EXPECT_TRUE(cell.load(times));
  EXPECT_EQ(times.cycle, 8u);
}

TEST(LastingCell, ItsReaderNeverFailsAndNeverGoesBack) {
  LastingCell<BackendTimes> cell;
  cell.store({.frames = 1, .cycle = 1});
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    for (std::uint64_t i = 2; !ends; ++i) cell.store({.frames = i, .cycle = i});
  });
  std::uint64_t newest = 0;
  for (int i = 0; i < 200'000; ++i) {
    BackendTimes times;
    // Overtaken each time in both cells: the writer does not stop, which no writer here does.
    if (!cell.load(times)) continue;
    EXPECT_EQ(times.frames, times.cycle);
    EXPECT_GE(times.cycle, newest);
    newest = times.cycle;
  }
  ends = true;
  writer.join();
}

TEST(NewestFrame, IsTheLastOneWhereTheCycleStandsStillInTheMiddleOfAStore) {
  SnapshotCell<ServoFrame> cell;
  ServoFrame stored;
  stored.cycle = 7;
  cell.store(stored);
  NewestFrame newest(cell);
  EXPECT_EQ(newest.read().cycle, 7u);
  begin_store(cell);
  ASSERT_FALSE(cell.load(stored));
  EXPECT_EQ(newest.read().cycle, 7u);
  stored.cycle = 8;
  cell.store(stored);
  EXPECT_EQ(newest.read().cycle, 8u);
}

}  // namespace
}  // namespace corbot::rt
