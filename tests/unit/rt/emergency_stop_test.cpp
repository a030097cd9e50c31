// SPDX-License-Identifier: Apache-2.0
// An emergency stop in the cycle: in the very cycle that sees it, and until it is released and cleared. Its
// sources, from several threads.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "rt/rig.h"

namespace corbot::test::emergency_stop_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};

class EmergencyStopInCycle : public ::testing::TestWithParam<StopSource> {
 protected:
  EmergencyStopInCycle() { rig.step(); }
  void press(bool pressed) { rig.emergency_stop->set(GetParam(), pressed); }
  std::uint64_t go() { return rig.submit(rig.planner.move_joints(rig.start(), {}, kThere, 0.0)); }
  Rig rig;
};

TEST_P(EmergencyStopInCycle, BeginsToSlowDownInTheCycleThatSeesIt) {
  const std::uint64_t running = go();
  const std::uint64_t waiting = rig.submit(rig.planner.dwell({kThere, 0.0}, 1.0));
  rig.step(250);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  press(true);
  EXPECT_TRUE(rig.step().published);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.stop_sources, static_cast<std::uint32_t>(GetParam()));
  const auto alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->code, AlarmCode::kEmergencyStop);
  EXPECT_EQ(alarm->value, static_cast<double>(GetParam()));
  EXPECT_FALSE(rig.completion()) << "at rest only";
  for (int i = 0; i < 1000 && rig.snapshot.command_id != 0; ++i) rig.step();
  for (const std::uint64_t id : {running, waiting}) {
    const auto verdict = rig.completion();
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->id, id);
    EXPECT_EQ(verdict->verdict, Verdict::kFault);
  }
  const Joints at_rest = rig.snapshot.position_q;
  EXPECT_NE(at_rest, kThere) << "not at its end";
  for (int i = 0; i < 100; ++i) {
    rig.step();
    ASSERT_EQ(rig.snapshot.position_q, at_rest);
  }
  EXPECT_FALSE(rig.alarm()) << "once";
}

TEST_P(EmergencyStopInCycle, IsNotClearedWhilePressedNorByItsRelease) {
  press(true);
  rig.step();
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.clears_done, 1u);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  press(false);
  rig.step(10);
  EXPECT_EQ(rig.snapshot.stop_sources, 0u);
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "latched";
  go();
  rig.step(2);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  go();
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kMoving);
}

TEST_P(EmergencyStopInCycle, BeatsAClearInTheSameCycle) {
  press(true);
  rig.step();
  press(false);
  rig.step();
  press(true);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
}

TEST_P(EmergencyStopInCycle, IsNotMissedBetweenTwoCycles) {
  press(true);
  press(false);
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.snapshot.stop_sources, 0u);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kEmergencyStop);
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_FALSE(rig.alarm()) << "once";
  press(true);
  press(false);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError) << "pressed again before the clear";
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_P(EmergencyStopInCycle, StopsTheFirstCycleOfANewTask) {
  press(true);
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kEmergencyStop);
}

TEST_P(EmergencyStopInCycle, OutlivesItsTask) {
  press(true);
  rig.step();
  press(false);
  rig.step(10);
  (void)rig.alarm();
  rig.restart();
  EXPECT_TRUE(rig.step().published);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kErrorInherited);
  const Joints before = rig.snapshot.position_q;
  go();
  rig.step(10);
  EXPECT_EQ(rig.snapshot.position_q, before);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kFault);
  EXPECT_FALSE(rig.alarm()) << "once";
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby) << "cleared for good";
}

TEST_P(EmergencyStopInCycle, OutlivesATaskThatNeverRan) {
  rig.task->stop_seen = 1;
  rig.restart();
  rig.restart();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kErrorInherited);
  press(true);
  rig.step();
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.task->stop_seen, 1u) << "still pressed";
  press(false);
  rig.step();
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_EQ(rig.task->stop_seen, 0u);
}

TEST(ErrorInCycle, OfAnyKindOutlivesItsTask) {
  Rig rig;
  rig.step();
  rig.backend.set_plugged(false);
  rig.step();
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  rig.restart();  // which finds the device open
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

INSTANTIATE_TEST_SUITE_P(Sources, EmergencyStopInCycle,
                         ::testing::Values(StopSource::kGpio, StopSource::kDevice), [](const auto& test) {
                           return test.param == StopSource::kGpio ? "gpio" : "device";
                         });

/// A reader never sees a source without its count: no cycle would latch it.
TEST(EmergencyStop, ASourceAndItsCountAreSeenTogether) {
  constexpr std::size_t kStops = 100'000;
  std::vector<EmergencyStop> stops(kStops);
  std::thread presses([&] {
    for (EmergencyStop& stop : stops) stop.set(StopSource::kGpio, true);
  });
  std::size_t uncounted = 0;
  for (const EmergencyStop& stop : stops) {
    while (stop.sources() == 0) {
    }
    if (stop.presses() == 0) ++uncounted;
  }
  presses.join();
  EXPECT_EQ(uncounted, 0u);
}

TEST(EmergencyStop, NoPressIsLostOrCountedTwiceWhereSeveralSourcesChange) {
  constexpr std::uint32_t kTimes = 50'000;
  EmergencyStop stop;
  std::vector<std::thread> threads;
  for (const StopSource source : {StopSource::kGpio, StopSource::kDevice, StopSource::kWatcher}) {
    threads.emplace_back([&stop, source] {
      for (std::uint32_t i = 0; i < kTimes; ++i) {
        stop.set(source, true);
        stop.set(source, true);
        stop.set(source, false);
      }
      stop.set(source, true);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(stop.presses(), 3 * (kTimes + 1));
  EXPECT_EQ(stop.sources(), 1u | 2u | 32u);
}

}  // namespace
}  // namespace corbot::test::emergency_stop_test
