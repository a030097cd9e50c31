// SPDX-License-Identifier: Apache-2.0
// How a device comes to where the arm is held, and what may end that.
#include <cmath>
#include <future>

#include "unit/backends/fake_bus.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class BusApproachTest : public BusBackendTest {
 protected:
  static constexpr std::int64_t kLong_ns = 20'000'000'000;

  void be_at_rest_with(double acceleration_q_s2) {
    arm_.joints[0].speed_q_s = 3.0;
    arm_.joints[0].acceleration_q_s2 = acceleration_q_s2;
    bus_.approach_ns = 0;
    bus_.has_encoders = true;
    bus_.reported_us = {0.0};
  }
  /// From rest at 0 to rest, with frames a millisecond apart.
  void expect_within(double acceleration_q_s2) {
    std::vector<double> way = bus_.positions_q;
    way.insert(way.begin(), 2, 0.0);
    way.push_back(way.back());
    double fastest = 0.0;
    for (std::size_t i = 2; i < way.size(); ++i) {
      const double speed = (way[i] - way[i - 1]) / 1e-3;
      const double before = (way[i - 1] - way[i - 2]) / 1e-3;
      fastest = std::max(fastest, speed);
      ASSERT_LE(std::abs(speed - before), acceleration_q_s2 * 1e-3 + 1e-6) << i;
    }
    EXPECT_NEAR(fastest, 0.5, 1e-6);
  }

  /// Calls open() in a thread of its own. The future has the error's text, or "open".
  static std::future<std::string> opening(BusBackend& backend) {
    return std::async(std::launch::async, [&backend]() -> std::string {
      try {
        backend.open(frame(1));
      } catch (const DeviceError& error) {
        return error.what();
      }
      return "open";
    });
  }
};

TEST_F(BusApproachTest, AStopDuringTheStartEndsIt) {
  bus_.approach_ns = kLong_ns;
  const auto backend = make(false, true);
  auto error = opening(*backend);
  ASSERT_TRUE(wait_until([&] { return approaches() == 1; }));
  bus_.pressed = true;
  EXPECT_THAT(error.get(), HasSubstr("the emergency stop was pressed"));
  EXPECT_EQ(bus_.halted, 1);
  EXPECT_EQ(bus_.relaxed, 1) << "as the profile says of every end";
  EXPECT_EQ(bus_.closed, 1);
  bus_.pressed = false;
  EXPECT_EQ(approaches(), 1);
  EXPECT_EQ(backend->health(), BackendHealth::kClosed);
}

TEST_F(BusApproachTest, AnEndDuringTheStartEndsIt) {
  for (const std::int64_t approach_ns : {kLong_ns, std::int64_t{0}}) {
    bus_.approach_ns = approach_ns;
    bus_.reported_us = {600.0};  // an approach in small steps has a long way, too
    bus_.halted = 0;
    const std::size_t before = bus_.copy().size();
    const auto backend = make();
    auto error = opening(*backend);
    ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > before; }));
    backend->cancel();
    EXPECT_THAT(error.get(), HasSubstr("the task was ended before"));
    EXPECT_EQ(bus_.halted, approach_ns > 0 ? 1 : 0);
    bus_.pulses_us.clear();
  }
}

TEST_F(BusApproachTest, AHaltThatFailsIsMadeUpFor) {
  const auto backend = make();
  backend->open(frame(1));
  bus_.approach_ns = kLong_ns;
  lose(*backend);
  bus_.fails = false;
  (void)clear(*backend, frame(2));
  ASSERT_TRUE(wait_until([&] { return approaches() == 2; }));
  const int opened = bus_.opened;
  bus_.halt_fails = true;
  backend->write(stopped(5));
  ASSERT_TRUE(wait_until([&] { return bus_.opened > opened + 1; })) << "lost again, and back";
  EXPECT_GE(bus_.halted, 2);
  const int done = bus_.halts_done;
  bus_.halt_fails = false;
  ASSERT_TRUE(wait_until([&] { return bus_.halts_done > done; })) << "until it is done";
  EXPECT_EQ(approaches(), 2) << "and nothing else";
}

TEST_F(BusApproachTest, EnergisesNothingWhileStopped) {
  const auto backend = make();
  backend->open(frame(1));
  EXPECT_EQ(bus_.energised, 1);
  backend->write(stopped(2));
  const int opened = bus_.opened;
  lose(*backend);  // and opened again at any time from here on
  bus_.fails = false;
  ASSERT_TRUE(wait_until([&] { return bus_.opened > opened; })) << "watched all the same";
  const int asked = bus_.asked;
  ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + 3; })) << "it waits";
  EXPECT_EQ(bus_.energised, 1);
  backend->write(frame(5));
  EXPECT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_EQ(bus_.energised, 2);
}

TEST_F(BusApproachTest, EnergisesNothingWhenStoppedBeforeTheStart) {
  stop_.set(StopSource::kGpio, true);
  const auto backend = make();
  (void)backend->connect();
  EXPECT_THROW(backend->open(frame(1)), DeviceError);
  EXPECT_EQ(bus_.energised, 0);
  EXPECT_TRUE(bus_.copy().empty());
}

TEST_F(BusApproachTest, GivesNoFirstPulseWhileStopped) {
  bus_.approach_ns = 0;
  bus_.is_silent = true;  // its servos may be without pulses
  const auto backend = make();
  backend->open(frame(1));
  backend->write(stopped(2));
  const int opened = bus_.opened;
  lose(*backend);  // and opened again at any time from here on
  const std::size_t before = bus_.copy().size();
  bus_.fails = false;
  ASSERT_TRUE(wait_until([&] { return bus_.opened > opened; }));
  const int asked = bus_.asked;
  ASSERT_TRUE(wait_until([&] { return bus_.asked > asked + 10; }));
  EXPECT_EQ(bus_.copy().size(), before);
  backend->write(stopped(4));
  ASSERT_TRUE(becomes(*backend, BackendHealth::kStandby));
  backend->write(frame(5));
  EXPECT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_GT(bus_.copy().size(), before);
}

TEST_F(BusApproachTest, WhereTheArmIsHeldElsewhereMeanwhileItIsApproachedAgain) {
  const auto backend = make();
  backend->open(frame(1));
  lose(*backend);
  bus_.approach_ns = 1'000'000'000;
  bus_.fails = false;
  const std::uint64_t cleared = clear(*backend, frame(2));
  ASSERT_TRUE(wait_until([&] { return approaches() == 2; }));
  backend->write(frame(cleared + 1, 1700.0));
  bus_.approach_ns = 2'000'000;
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  EXPECT_EQ(approaches(), 3) << "never in one step";
}

TEST_F(BusApproachTest, ADriveThatHoldsItsLoadDoesNotRampFromAGuess) {
  bus_.approach_ns = 0;
  bus_.is_drive = true;
  bus_.is_silent = true;
  const auto backend = make();
  EXPECT_THAT(opening(*backend).get(), HasSubstr("reports no position"));
  EXPECT_TRUE(bus_.copy().empty());
}

TEST_F(BusApproachTest, ADeviceThatFailsAgainAtOnceIsTriedMoreAndMoreRarely) {
  const auto backend = make();
  backend->open(frame(1));
  for (int i = 0; i < 7; ++i) {
    const int opened = bus_.opened;
    lose(*backend);
    bus_.fails = false;
    ASSERT_TRUE(wait_until([&] { return bus_.opened > opened; }));
    (void)clear(*backend, frame(static_cast<std::uint64_t>(10 * i + 10)));
    ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
  }
  const std::lock_guard lock(bus_.mutex);
  const auto since = bus_.opened_at.at(7) - bus_.opened_at.at(4);
  EXPECT_GE(since, std::chrono::milliseconds(8 + 10 + 10)) << "1, 2, 4, 8, 10, 10 ms";
}

TEST_F(BusApproachTest, AServoThatIsOnIsApproachedFromItsPulseThoughAnotherIsOff) {
  for (const int stagger_ms : {0, 5}) {
    bus_.approach_ns = 0;
    bus_.reported_us = {1480.0, 0.0};
    bus_.pulses_us.clear();
    settings_.stagger_ms = stagger_ms;
    const auto backend = make();
    ServoFrame first = frame(1, 1500.0);
    first.servo_count = 2;
    first.pulse_us[1] = 1900.0;
    backend->open(first);
    backend->close();
    const std::lock_guard lock(bus_.mutex);
    double at_us = 1480.0;
    for (const double pulse_us : bus_.pulses_us) {
      EXPECT_LE(std::abs(pulse_us - at_us), 0.4 + 1e-9) << stagger_ms;
      at_us = pulse_us;
    }
    EXPECT_EQ(at_us, 1500.0);
    EXPECT_EQ(bus_.second_us.back(), 1900.0) << "what is off begins where it was sent last";
    EXPECT_TRUE(
        std::all_of(bus_.second_us.begin(), bus_.second_us.end(), [](double us) { return us == 1900.0; }));
  }
}

TEST_F(BusApproachTest, LeadsNoJointFasterThanItMay) {
  arm_.joints[0].speed_q_s = 0.05;
  bus_.approach_ns = 0;
  bus_.has_encoders = true;
  bus_.reported_us = {0.0};
  const auto backend = make();
  ServoFrame first = frame(1);
  first.position_q[0] = 0.001;
  backend->open(first);
  EXPECT_GE(bus_.copy().size(), 20u) << "0.00005 rad a millisecond";
}

TEST_F(BusApproachTest, GainsAndLosesItsSpeedWithinTheAcceleration) {
  be_at_rest_with(4.0);
  const auto backend = make();
  ServoFrame first = frame(1);
  first.position_q[0] = 0.2;
  backend->open(first);
  backend->close();
  expect_within(4.0);
  EXPECT_EQ(bus_.positions_q.back(), 0.2);
}

TEST_F(BusApproachTest, AStopOnTheWaySlowsItDownWithinTheAcceleration) {
  be_at_rest_with(4.0);
  const auto backend = make();
  ServoFrame held = stopped(1);
  backend->open(held);
  held.needs_clear = false;
  held.cycle = 2;
  held.position_q[0] = 50.0;
  backend->write(held);
  ASSERT_TRUE(wait_until([&] { return bus_.copy().size() > 150; }));
  held.needs_clear = true;
  held.cycle = 3;
  backend->write(held);
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(bus_.mutex);
    return bus_.positions_q.back() == *(bus_.positions_q.end() - 2);
  })) << "it comes to rest";
  backend->close();
  expect_within(4.0);
  EXPECT_LT(bus_.positions_q.back(), 49.0);
}

TEST_F(BusApproachTest, CatchesUpAtTwiceTheSpeedAfterAStall) {
  arm_.joints[0].speed_q_s = 1.0;
  arm_.gripper = {1, 1900.0, 1100.0, 0.5};
  const auto at = [&](std::uint64_t cycle, double position_q, double gripper_us) {
    ServoFrame result;
    result.cycle = cycle;
    result.time_ns = static_cast<std::int64_t>(cycle) * 1'000'000;
    result.servo_count = 2;
    result.position_q[0] = position_q;
    result.pulse_us = {1500.0 - 600.0 * position_q, gripper_us};
    return result;
  };
  const auto backend = make();
  backend->open(at(1, 0.0, 1900.0));
  ASSERT_TRUE(wait_until([&] { return !bus_.copy().empty(); }));
  const std::size_t before = bus_.copy().size();
  backend->write(at(301, 0.5, 1100.0));  // 0.3 s later
  ASSERT_TRUE(wait_until([&] { return newest_sent() == 301; }));
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(bus_.mutex);
    return std::abs(bus_.pulses_us.back() - 1200.0) < 1e-9;
  }));
  const std::lock_guard lock(bus_.mutex);
  for (std::size_t i = before; i < bus_.pulses_us.size(); ++i) {
    EXPECT_LE(std::abs(bus_.pulses_us[i] - bus_.pulses_us[i - 1]), 2.0 * 600.0 * 0.021 + 1e-9);
  }
}

}  // namespace
}  // namespace corbot::rt
