// SPDX-License-Identifier: Apache-2.0
// Energy: what a device gets only after a Clear, and when it is taken off.
#include <cmath>

#include "unit/backends/fake_bus.h"

namespace corbot::rt {
namespace {

class BusStandbyTest : public BusBackendTest {
 protected:
  /// So many more looks of the thread.
  void let_look(int times = 10) {
    const int asked = bus_.asked;
    ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + times; }));
  }
};

TEST_F(BusStandbyTest, WhatIsLostAndBackGetsNeitherEnergyNorMotionBeforeClear) {
  bus_.approach_ns = 0;
  const auto backend = make();
  backend->open(frame(1, 1500.0));
  const int opened = bus_.opened;
  lose(*backend);
  const std::size_t before = bus_.copy().size();
  bus_.fails = false;
  ASSERT_TRUE(wait_until([&] { return bus_.opened > opened; }));
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kLost) << "the cycle may not have seen it yet";
  backend->write(stopped(2, 1510.0, true));
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kLost)
      << "it may be of an Error before, and be cleared by the next";
  backend->write(stopped(3, 1510.0, true));
  ASSERT_TRUE(becomes(*backend, BackendHealth::kStandby));
  let_look();
  EXPECT_EQ(bus_.copy().size(), before);
  EXPECT_EQ(bus_.energised, 1);
  EXPECT_EQ(backend->cause(), DeviceCause::kHungUp) << "until it is open";
  EXPECT_TRUE(wait_until([&] { return backend->read().commanded; })) << "though nothing is read back else";
  backend->write(frame(4, 1500.0));
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  EXPECT_EQ(bus_.energised, 2);
  EXPECT_GT(bus_.copy().size(), before);
}

TEST_F(BusStandbyTest, AFrameOfAnErrorBeforeIsNoAnswerToALoss) {
  const auto backend = make();
  backend->open(frame(1));
  backend->write(stopped(2));
  ASSERT_TRUE(wait_until([&] { return newest_sent() == 2; }));
  lose(*backend);
  bus_.fails = false;
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kLost) << "that Error was there before";
  const std::size_t sent = bus_.copy().size();
  backend->write(frame(3));  // its Clear, before the loss was seen
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kLost);
  EXPECT_EQ(bus_.copy().size(), sent) << "nothing is energised or moves";
  backend->write(stopped(4, 1500.0, true));
  EXPECT_TRUE(becomes(*backend, BackendHealth::kStandby));
}

TEST_F(BusStandbyTest, WhatTheCycleHadClearedBeforeTheThreadLookedCounts) {
  const auto backend = make();
  backend->open(frame(1));
  lose(*backend);
  bus_.fails = false;
  let_look();
  backend->write(frame(3));
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kLost) << "it may have been written before the loss was seen";
  backend->write(frame(4));
  EXPECT_TRUE(becomes(*backend, BackendHealth::kOpen)) << "three frames later it is known";
}

TEST_F(BusStandbyTest, ADriveLosesItsEnergyAtPowerOffAndGetsItAgainByClear) {
  be_drive(0.25);
  const auto backend = make(true);
  ServoFrame at = frame(1, 0.25);
  at.position_q[0] = 0.25;
  backend->open(at);
  EXPECT_TRUE(bus_.is_energised);
  at.cycle = 2;
  at.needs_clear = true;
  backend->write(at);
  ASSERT_TRUE(wait_until([&] { return newest_sent() == 2; }));
  let_look();
  EXPECT_TRUE(bus_.is_energised) << "it comes to rest first";
  EXPECT_EQ(backend->health(), BackendHealth::kOpen);
  at.cycle = 3;
  at.power_off = true;
  backend->write(at);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kStandby));
  EXPECT_FALSE(bus_.is_energised);
  EXPECT_EQ(backend->cause(), DeviceCause::kNone);
  const std::size_t sent = bus_.copy().size();
  let_look();
  EXPECT_TRUE(backend->read().measured) << "it is watched all the same";
  EXPECT_EQ(bus_.copy().size(), sent);
  EXPECT_EQ(bus_.de_energised, 1) << "once";
  at.cycle = 4;
  at.needs_clear = at.power_off = false;
  backend->write(at);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  EXPECT_TRUE(bus_.is_energised);
  EXPECT_EQ(bus_.energised, 2);
}

TEST_F(BusStandbyTest, PulsesGoOnAtPowerOff) {
  const auto backend = make();
  backend->open(frame(1));
  backend->write(stopped(2, 1500.0, true));
  ASSERT_TRUE(wait_until([&] { return newest_sent() == 2; }));
  const std::size_t sent = bus_.copy().size();
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > sent + 10; })) << "the arm is held";
  EXPECT_EQ(backend->health(), BackendHealth::kOpen);
}

TEST_F(BusStandbyTest, WithAFrozenCycleTheEnergyGoesOffByItself) {
  be_drive(0.0);
  settings_.ramp_s = 0.05;
  const auto backend = make(true);
  backend->open(frame(1, 0.0));
  const auto begin = Clock::now();
  stop_.set(StopSource::kGpio, true);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kStandby));
  EXPECT_GE(Clock::now() - begin, std::chrono::milliseconds(50));
  EXPECT_FALSE(bus_.is_energised);
  stop_.set(StopSource::kGpio, false);
  let_look();
  EXPECT_FALSE(bus_.is_energised) << "released, not cleared";
  backend->write(stopped(3, 0.0, true));
  let_look();
  EXPECT_FALSE(bus_.is_energised) << "the cycle runs again, and is in Error";
  backend->write(frame(4, 0.0));
  EXPECT_TRUE(becomes(*backend, BackendHealth::kOpen));
}

TEST_F(BusStandbyTest, InCategory0TheEnergyGoesOffAtThePress) {
  be_drive(0.0);
  settings_.ramp_s = 0.0;
  const auto backend = make(true);
  backend->open(frame(1, 0.0));
  stop_.set(StopSource::kGpio, true);
  stop_.set(StopSource::kGpio, false);  // however short it was
  ASSERT_TRUE(becomes(*backend, BackendHealth::kStandby));
  EXPECT_FALSE(bus_.is_energised);
}

TEST_F(BusStandbyTest, APressThatWasClearedInTimeTakesNoEnergy) {
  be_drive(0.0);
  settings_.ramp_s = 0.2;
  const auto backend = make(true);
  backend->open(frame(1, 0.0));
  const auto begin = Clock::now();
  stop_.set(StopSource::kGpio, true);
  let_look(2);
  stop_.set(StopSource::kGpio, false);
  backend->write(stopped(2, 0.0));
  let_look(2);
  std::uint64_t cycle = 2;
  ASSERT_TRUE(wait_until([&] {
    backend->write(frame(++cycle, 0.0));
    return Clock::now() - begin > std::chrono::milliseconds(400);
  }));
  // On a machine that stood still meanwhile the ramp's time was over before the Clear.
  if (bus_.de_energised > 0) GTEST_SKIP() << "skipped: this machine stood still";
  EXPECT_EQ(backend->health(), BackendHealth::kOpen);
}

TEST_F(BusStandbyTest, AStartInErrorLooksAtTheStopInputFirst) {
  bus_.has_stop_input = bus_.pressed = true;
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  EXPECT_EQ(stop_.sources(), static_cast<std::uint32_t>(StopSource::kDevice)) << "before it stands by";
}

TEST_F(BusStandbyTest, AStartInErrorMovesNothing) {
  be_drive(0.0);
  const auto backend = make(true);
  (void)backend->connect();
  backend->open(stopped(1, 0.0, true));
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  ASSERT_TRUE(wait_until([&] { return bus_.de_energised == 1; })) << "drives may hold from before";
  let_look();
  EXPECT_TRUE(bus_.copy().empty());
  EXPECT_EQ(bus_.energised, 0);
  EXPECT_TRUE(backend->read().measured);
  backend->write(frame(2, 0.0));
  EXPECT_TRUE(becomes(*backend, BackendHealth::kOpen));
}

TEST_F(BusStandbyTest, AStopWhileTheDrivesAreBeingEnabledEndsThat) {
  be_drive(0.0);
  const auto backend = make(true);
  backend->open(stopped(1, 0.0, true));
  bus_.energises_for_ever = true;
  backend->write(frame(2, 0.0));
  ASSERT_TRUE(wait_until([&] { return bus_.energised == 1; }));
  stop_.set(StopSource::kGpio, true);
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  EXPECT_FALSE(bus_.is_energised);
  EXPECT_EQ(bus_.energised, 1);
}

TEST_F(BusStandbyTest, AMissInStandbyIsNoLossAndThreeAre) {
  const auto backend = make();
  backend->open(stopped(1));
  bus_.misses = 2;
  ASSERT_TRUE(wait_until([&] { return bus_.misses == 0; }));
  let_look();
  EXPECT_EQ(backend->health(), BackendHealth::kStandby);
  bus_.misses = 3;
  EXPECT_TRUE(becomes(*backend, BackendHealth::kLost));
  EXPECT_EQ(backend->cause(), DeviceCause::kNoAnswer);
  (void)answer(*backend, stopped(2));  // it is in Error all the time
  EXPECT_TRUE(bus_.copy().empty());
}

TEST_F(BusStandbyTest, AGarbledReadingIsNotWhereTheArmIsHeld) {
  for (const double garbled_us : {1800.0, 700.0, 2800.0}) {
    bus_.garbles_every = 3;
    bus_.garbled_us = garbled_us;
    const auto backend = make();
    backend->open(stopped(1));
    int good = 0;
    const int asked = bus_.asked;
    ASSERT_TRUE(wait_until([&] {
      const ServoFeedback feedback = backend->read();
      if (feedback.commanded) {
        EXPECT_NEAR(feedback.position_q[0], 0.0, 1e-9) << garbled_us;
        ++good;
      }
      return ::testing::Test::HasFailure() || (good > 10 && bus_.asked > asked + 60);
    })) << "two in a row are good";
    if (::testing::Test::HasFailure()) return;
  }
}

/// Else a Clear would bring it back: the cycle refuses that where the joint is beyond its range.
TEST_F(BusStandbyTest, APulseBeyondTheServosRangeIsSaid) {
  arm_.servos[0].pulse_min_us = 1000.0;
  arm_.servos[0].pulse_max_us = 2000.0;
  for (const double reported_us : {900.0, 2100.0, 1990.0}) {
    bus_.reported_us = {reported_us};
    const auto backend = make();
    backend->open(stopped(1));
    let_look();
    EXPECT_TRUE(wait_until([&] { return backend->read().commanded; })) << reported_us;
    const ServoMap& map = arm_.servos[0];
    EXPECT_NEAR(backend->read().position_q[0], (reported_us - map.zero_us) / (map.direction * map.us_per_q),
                1e-9);
  }
}

TEST_F(BusStandbyTest, ClosesInStandby) {
  const auto backend = make(false, true);
  backend->open(stopped(1));
  backend->close();
  EXPECT_EQ(backend->health(), BackendHealth::kClosed);
  EXPECT_EQ(bus_.relaxed, 1);
  EXPECT_EQ(bus_.closed, 1);
}

TEST_F(BusStandbyTest, TheFirstPulsesComeOneAfterAnother) {
  arm_.dof = 3;
  for (const std::int64_t approach_ns : {std::int64_t{0}, std::int64_t{2'000'000}}) {
    bus_.approach_ns = approach_ns;
    bus_.powers_up = true;
    bus_.sent.clear();
    bus_.servos.clear();
    bus_.sent_at.clear();
    settings_.stagger_ms = 20;
    const auto backend = make();
    ServoFrame first = frame(1);
    first.servo_count = 4;
    first.pulse_us = {1500.0, 1500.0, 1500.0, 1500.0};
    backend->open(first);
    backend->close();
    const std::lock_guard lock(bus_.mutex);
    ASSERT_GE(bus_.servos.size(), 4u);
    for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(bus_.servos[i], i + 1);
    for (std::size_t i = 1; i < 4; ++i)
      EXPECT_GE(bus_.sent_at[i] - bus_.sent_at[i - 1], std::chrono::milliseconds(20));
    bus_.pulses_us.clear();
  }
}

TEST_F(BusStandbyTest, TheCycleOfTheNewestFrameThatTheDeviceHasIsReported) {
  arm_.joints[0].speed_q_s = 1.0;
  arm_.gripper = {1, 1900.0, 1100.0, 0.5};
  const auto at = [](std::uint64_t cycle, double position_q) {
    ServoFrame result = frame(cycle, 1500.0 - 600.0 * position_q);
    result.time_ns = static_cast<std::int64_t>(cycle) * 1'000'000;
    result.servo_count = 2;
    result.pulse_us[1] = 1900.0;
    result.position_q[0] = position_q;
    return result;
  };
  const auto backend = make();
  backend->open(at(1, 0.0));
  backend->write(at(2, 0.0));
  ASSERT_TRUE(wait_until([&] { return backend->times().cycle == 2; }));
  backend->write(at(3, 0.5));  // more than one frame may go
  ASSERT_TRUE(wait_until([&] { return backend->times().cycle == 3; }));
  const std::lock_guard lock(bus_.mutex);
  EXPECT_EQ(bus_.positions_q.back(), 0.5);
}

/// A joint at a constant speed, by virtual time, which goes as fast as the backend says, as in the cycle.
TEST_F(BusStandbyTest, ADeviceThatFallsBehindSlowsTheArmAndNotItsPath) {
  constexpr double kSpeed_q_s = 1.0;
  arm_.joints[0].speed_q_s = 10.0;  // what limits steps is out of the way
  bus_.period_ns = 20'000'000;
  bus_.busy_ns = 33'000'000;
  const auto backend = make();
  ServoFrame now = frame(1);
  backend->open(now);
  double virtual_s = 0.0;
  std::string log;
  std::size_t known_from = 0;
  auto due = Clock::now();
  ASSERT_TRUE(wait_until([&] {
    due = std::max(due + std::chrono::milliseconds(1), Clock::now());  // as the loop: never a burst
    std::this_thread::sleep_until(due);
    virtual_s += 1e-3 * backend->times().speed_ratio;
    now.cycle++;
    now.position_q[0] = kSpeed_q_s * virtual_s;
    backend->write(now);
    log += to_string(backend->drain_log());
    const std::size_t sent = bus_.copy().size();
    if (known_from == 0 && backend->times().speed_ratio < 1.0) known_from = sent + 1;
    return known_from > 0 && sent > known_from + 20;
  }));
  EXPECT_EQ(backend->health(), BackendHealth::kDegraded);
  EXPECT_EQ(backend->cause(), DeviceCause::kTooSlow);
  EXPECT_THAT(log, ::testing::HasSubstr("degraded: fake: takes "));
  EXPECT_THAT(log, ::testing::HasSubstr(" frames a second, but announced 50.0; the arm moves slower"));
  EXPECT_LE(backend->times().speed_ratio, 20.0 / 33.0 + 1e-3);
  const std::lock_guard lock(bus_.mutex);
  std::vector<double> ways;
  for (std::size_t i = known_from + 1; i < bus_.positions_q.size(); ++i)
    ways.push_back(bus_.positions_q[i] - bus_.positions_q[i - 1]);
  std::sort(ways.begin(), ways.end());
  // A chord's deviation grows with the square of its length. The median: this machine may stand still.
  EXPECT_LE(ways.at(ways.size() / 2), kSpeed_q_s * 0.020 * 1.1);
  bus_.busy_ns = 0;
}

TEST(FrameRate, SlowsTheArmByTheShareThatIsMissing) {
  FrameRate rate;
  rate.begin(20'000'000);
  for (int i = 0; i < 500; ++i) (void)rate.count(5'000'000);
  EXPECT_EQ(rate.speed_ratio(), 1.0);
  EXPECT_NEAR(rate.reached_hz(), 50.0, 1e-9);
  for (int i = 0; i < 100; ++i) (void)rate.count(33'000'000);
  EXPECT_TRUE(rate.is_slow());
  EXPECT_NEAR(rate.reached_hz(), 30.3, 0.1);
  EXPECT_NEAR(rate.speed_ratio(), 20.0 / 33.0, 1e-9);
  for (int i = 0; i < 100; ++i) (void)rate.count(10'000'000'000);
  EXPECT_EQ(rate.speed_ratio(), FrameRate::kLeastRatio);
}

TEST(FrameRate, LetsOneLongFrameBe) {
  FrameRate rate;
  rate.begin(20'000'000);
  for (int second = 0; second < 20; ++second) {
    for (int i = 0; i < 50; ++i) (void)rate.count(i == 7 ? 3'000'000'000 : 19'000'000);
    EXPECT_EQ(rate.speed_ratio(), 1.0);
  }
}

TEST(FrameRate, GainsSpeedByStepsWhenItIsFastAgain) {
  FrameRate rate;
  rate.begin(20'000'000);
  for (int i = 0; i < 100; ++i) (void)rate.count(40'000'000);
  ASSERT_NEAR(rate.speed_ratio(), 0.5, 1e-9);
  for (int i = 0; i < 100; ++i) (void)rate.count(39'000'000);
  EXPECT_NEAR(rate.speed_ratio(), 0.5, 1e-9) << "not for a little";
  double before = rate.speed_ratio();
  int steps = 0;
  for (int i = 0; i < 1000 && rate.is_slow(); ++i) {
    if (!rate.count(10'000'000)) continue;
    EXPECT_GT(rate.speed_ratio(), before);
    EXPECT_LE(rate.speed_ratio(), before + 0.1 + 1e-9);
    before = rate.speed_ratio();
    ++steps;
  }
  EXPECT_FALSE(rate.is_slow());
  EXPECT_GE(steps, 5);
}

}  // namespace
}  // namespace corbot::rt
