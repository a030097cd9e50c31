// SPDX-License-Identifier: Apache-2.0
// A thread of a device that stood still for a while, and goes on: where the arm is by then is not the next
// place to go to.
#include "rt/backends/bus/standstill.h"
#include "rt/backends/bus/step_limit.h"
#include "unit/backends/fake_bus.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kPeriod_ns = 1'000'000;

TEST(Standstill, IsLongerThanASecondInWhichTheCycleWentOn) {
  Standstill watch;
  Clock::time_point now{10s};
  watch.begin(now, 100);
  EXPECT_FALSE(watch.look(now += 1000ms, 1100, kPeriod_ns)) << "not longer";
  const auto still_ns = watch.look(now += 1001ms, 2101, kPeriod_ns);
  ASSERT_TRUE(still_ns);
  EXPECT_EQ(*still_ns, 1'001'000'000);
  EXPECT_FALSE(watch.look(now += 20ms, 2121, kPeriod_ns)) << "it goes on";
  EXPECT_TRUE(watch.look(now += 3000ms, 2121 + 1500, kPeriod_ns))
      << "a cycle that misses half of its steps works, too";
}

TEST(Standstill, OfTheWholeMachineIsNone) {
  Standstill watch;
  Clock::time_point now{10s};
  watch.begin(now, 100);
  EXPECT_FALSE(watch.look(now += 60s, 100, kPeriod_ns));
  EXPECT_FALSE(watch.look(now += 60s, 120, kPeriod_ns)) << "the cycle was the first to go on";
  EXPECT_FALSE(watch.look(now += 60s, 7, kPeriod_ns)) << "what goes back has not gone on";
}

class BusStandstillTest : public BusBackendTest {
 protected:
  /// The cycle goes on, by the time that passes, while the thread waits in a call to the device, until it has
  /// waited so long. Returns the number of the newest frame.
  std::uint64_t go_on_without_the_thread(BusBackend& backend, Clock::duration how_long) {
    const std::lock_guard lock(bus_.mutex);  // which the device's send() waits for
    const auto begin = Clock::now();
    auto beaten_at = begin;
    std::uint32_t beats = backend.beats();
    std::uint64_t cycle = 0;
    EXPECT_TRUE(wait_until([&] {
      const auto now = Clock::now();
      cycle = 2 + static_cast<std::uint64_t>((now - begin) / 1ms);
      ServoFrame newest = frame(cycle, 1500.0 + static_cast<double>(cycle));
      newest.needs_clear = true;  // the arm may be in Error by then
      backend.write(newest);
      if (backend.beats() != beats) beaten_at = now;
      beats = backend.beats();
      return now - beaten_at > how_long;
    }));
    return cycle;
  }
};

TEST_F(BusStandstillTest, IsALossAndNothingOfAfterItIsSentBeforeClear) {
  const auto backend = make();
  backend->open(frame(1));
  const std::uint64_t newest = go_on_without_the_thread(*backend, 1500ms);
  std::string log;
  ASSERT_TRUE(wait_until([&] {
    log += to_string(backend->drain_log());
    return log.find("lost: fake: its thread stood still for ") != std::string::npos;
  })) << log;
  EXPECT_EQ(backend->cause(), DeviceCause::kThreadStill);
  const std::uint64_t latched = answer(*backend, frame(newest + 1)).cycle;
  EXPECT_LT(newest_sent() + 1000, newest) << "of before it";
  backend->write(frame(latched));
  ASSERT_TRUE(becomes(*backend, BackendHealth::kOpen));
  EXPECT_TRUE(wait_until([&] { return newest_sent() == latched; }));
}

TEST_F(BusStandstillTest, TakesTheEnergyOffADriveThoughItAnswers) {
  be_drive(0.0);
  const auto backend = make();
  backend->open(frame(1, 0.0));
  ASSERT_TRUE(bus_.is_energised);
  bus_.blocks_open = true;
  (void)go_on_without_the_thread(*backend, 1500ms);
  ASSERT_TRUE(becomes(*backend, BackendHealth::kLost));
  EXPECT_TRUE(wait_until([&] { return !bus_.is_energised; })) << "not only when it is back";
  bus_.blocks_open = false;
}

/// Whatever was missed of the arm's way: nothing hurries in Error.
TEST(StepLimit, CatchesUpInErrorAtNoMoreThanTheSpeed) {
  ArmModel arm;
  arm.dof = 1;
  arm.joints[0].speed_q_s = 1.0;
  arm.gripper = {1, 1900.0, 1100.0, 0.5};
  ServoFrame last;
  last.servo_count = 2;
  last.pulse_us = {1500.0, 1900.0};
  const auto step_q = [&](bool needs_clear, double to_q) {
    ServoFrame next = last;
    next.time_ns = 20'000'000;
    next.needs_clear = needs_clear;
    next.position_q[0] = to_q;
    const bool is_all = limit_step(arm, last, 0.02, 0.04, next);
    EXPECT_EQ(is_all, next.position_q[0] == to_q);
    return next.position_q[0];
  };
  EXPECT_NEAR(step_q(false, 1.0), 0.04, 1e-12);
  EXPECT_LE(step_q(true, 1.0), 0.0211);
  EXPECT_EQ(step_q(true, 0.02), 0.02) << "what did not stall is not held up";
}

}  // namespace
}  // namespace corbot::rt
