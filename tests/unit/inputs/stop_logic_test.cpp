// SPDX-License-Identifier: Apache-2.0
// Tests when a press counts, when the servos have power, and when the watchdog output toggles: pure, given
// the time.
#include "rt/inputs/stop_logic.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "rt/inputs/watchdog_logic.h"

namespace corbot::rt {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(StopLogic, IsPressedAtOnceAndReleasedAfterAWhile) {
  StopLogic logic;
  EXPECT_TRUE(logic.pressed()) << "until it was looked at";
  EXPECT_FALSE(logic.step(false, 0));
  EXPECT_TRUE(logic.step(true, 10 * kMs));
  EXPECT_TRUE(logic.step(false, 11 * kMs));
  EXPECT_TRUE(logic.step(false, 59 * kMs));
  EXPECT_FALSE(logic.step(false, 60 * kMs));
}

TEST(StopLogic, TakesAContactThatBouncesForOnePress) {
  StopLogic logic;
  EXPECT_FALSE(logic.step(false, 0));
  int changes = 0;
  bool last = false;
  for (int i = 1; i < 400; ++i) {
    const bool now = logic.step(i < 100 && i % 3 == 0, i * kMs);
    changes += now != last ? 1 : 0;
    last = now;
  }
  EXPECT_EQ(changes, 2);
  EXPECT_FALSE(last);
}

TEST(StopLogic, IsPressedWhenItIsSoAtTheStart) {
  StopLogic logic;
  EXPECT_TRUE(logic.step(true, 0));
  EXPECT_TRUE(logic.step(false, 49 * kMs));
  EXPECT_FALSE(logic.step(false, 51 * kMs));
}

constexpr std::int64_t kRamp_ns = 1000 * kMs;
CycleView runs(std::uint64_t cycle) { return {.cycle = cycle}; }
CycleView fails(std::uint64_t cycle) { return {.cycle = cycle, .in_error = true}; }
CycleView rests(std::uint64_t cycle) { return {.cycle = cycle, .in_error = true, .power_off = true}; }

TEST(PowerLogic, GoesWithTheCyclesWordAndComesBackWithClear) {
  PowerLogic logic(1, kRamp_ns);
  EXPECT_TRUE(logic.step(0, false, 0, runs(2)));
  EXPECT_TRUE(logic.step(1 * kMs, true, 1, runs(3))) << "pressed: the arm slows down";
  EXPECT_TRUE(logic.step(300 * kMs, true, 1, fails(4)));
  EXPECT_FALSE(logic.step(301 * kMs, true, 1, rests(5))) << "at rest";
  EXPECT_FALSE(logic.step(302 * kMs, false, 1, rests(6))) << "released, not cleared";
  EXPECT_FALSE(logic.step(303 * kMs, false, 1, runs(7))) << "may be older than what took it off";
  EXPECT_TRUE(logic.step(304 * kMs, false, 1, runs(8))) << "cleared";
}

TEST(PowerLogic, GoesByItsOwnClockWhenTheCycleStandsStill) {
  PowerLogic logic(1, kRamp_ns);
  EXPECT_TRUE(logic.step(0, false, 0, runs(7)));
  EXPECT_TRUE(logic.step(5 * kMs, true, 1, runs(7)));
  EXPECT_TRUE(logic.step(1004 * kMs, false, 1, runs(7))) << "released meanwhile";
  EXPECT_FALSE(logic.step(1005 * kMs, false, 1, runs(7)));
  EXPECT_FALSE(logic.step(9000 * kMs, false, 1, runs(7)));
  EXPECT_FALSE(logic.step(9002 * kMs, false, 1, runs(8))) << "it has not seen the press yet";
  EXPECT_FALSE(logic.step(9004 * kMs, false, 1, fails(9)));
  EXPECT_TRUE(logic.step(9900 * kMs, false, 1, runs(20))) << "cleared";
}

TEST(PowerLogic, CountsFromTheFirstPressOfSeveral) {
  PowerLogic logic(1, kRamp_ns);
  EXPECT_TRUE(logic.step(0, true, 1, runs(2)));
  EXPECT_TRUE(logic.step(900 * kMs, true, 2, fails(3)));
  EXPECT_FALSE(logic.step(1000 * kMs, false, 3, fails(4)));
}

TEST(PowerLogic, GoesAtThePressInCategory0) {
  PowerLogic logic(0, kRamp_ns);
  EXPECT_TRUE(logic.step(0, false, 0, runs(2)));
  EXPECT_FALSE(logic.step(1 * kMs, true, 1, runs(3)));
  EXPECT_FALSE(logic.step(2 * kMs, false, 1, fails(6)));
  EXPECT_TRUE(logic.step(3 * kMs, false, 1, runs(7))) << "cleared";
}

TEST(PowerLogic, CountsAPressThatWasOverBeforeItLooked) {
  for (const int category : {0, 1}) {
    PowerLogic logic(category, kRamp_ns);
    EXPECT_TRUE(logic.step(0, false, 0, runs(2)));
    EXPECT_EQ(logic.step(1 * kMs, false, 1, runs(3)), category == 1);
    EXPECT_FALSE(logic.step(1001 * kMs, false, 1, fails(9)));
    EXPECT_TRUE(logic.step(1002 * kMs, false, 1, runs(10))) << "cleared";
  }
}

TEST(PowerLogic, GoesWithAFaultThatIsNoPress) {
  PowerLogic at_once(1, kRamp_ns);
  EXPECT_TRUE(at_once.step(0, false, 0, runs(2)));
  EXPECT_FALSE(at_once.step(1 * kMs, false, 0, rests(3)));
  EXPECT_FALSE(at_once.step(2 * kMs, false, 0, fails(4)));
  EXPECT_TRUE(at_once.step(3 * kMs, false, 0, runs(6))) << "cleared";
  PowerLogic slowly(1, kRamp_ns);
  const CycleView slows{.cycle = 3, .in_error = true, .fault_stop = true};
  EXPECT_TRUE(slowly.step(0, false, 0, slows));
  EXPECT_FALSE(slowly.step(1000 * kMs, false, 0, slows)) << "a cycle that freezes on its ramp";
}

TEST(PowerLogic, StaysOnInAnErrorThatKeepsIt) {
  PowerLogic logic(1, kRamp_ns);
  for (std::uint64_t i = 0; i < 5000; ++i) {
    ASSERT_TRUE(logic.step(static_cast<std::int64_t>(i) * kMs, false, 0, fails(i))) << "StopAndHold";
  }
}

TEST(PowerLogic, TakesNothingFromAViewThatCouldNotBeRead) {
  PowerLogic logic(0, kRamp_ns);
  const CycleView unknown{.in_error = true, .is_known = false};
  EXPECT_FALSE(logic.step(0, false, 1, unknown));
  EXPECT_FALSE(logic.step(1 * kMs, false, 1, runs(500))) << "this one may be older than the press";
  EXPECT_FALSE(logic.step(2 * kMs, false, 1, runs(501)));
  EXPECT_TRUE(logic.step(3 * kMs, false, 1, runs(502)));
}

TEST(PowerLogic, BeginsWithoutPowerWhereAnErrorWasInherited) {
  PowerLogic logic(1, kRamp_ns);
  logic.latch();
  EXPECT_FALSE(logic.step(0, false, 0, fails(700)));
  EXPECT_TRUE(logic.step(1 * kMs, false, 0, runs(701))) << "cleared";
}

/// A watcher that looks every 2 ms at a cycle of 1 ms and a device's thread of 5 ms.
class Watched {
 public:
  explicit Watched(std::int64_t period_ns) : logic(period_ns) {}
  void look(bool may_run = true) {
    now_ns += 2 * kMs;
    if (!is_cycle_frozen) view.cycle += 2;
    if (!is_bus_frozen && now_ns % (5 * kMs) < 2 * kMs) ++view.bus_beats;
    if (is_cycle_frozen || is_bus_frozen) frozen_ns += 2 * kMs;
    const bool now = logic.step(now_ns, may_run, view);
    if (now != level) changed_at_ns = now_ns;
    changes += now != level ? 1 : 0;
    level = now;
  }
  void look_for(std::int64_t time_ns, bool may_run = true) {
    for (const std::int64_t end_ns = now_ns + time_ns; now_ns < end_ns;) look(may_run);
  }
  WatchdogLogic logic;
  CycleView view{.cycle = 5, .bus_beats = 1};
  std::int64_t now_ns{7 * kMs};
  std::int64_t frozen_ns{0};
  std::int64_t changed_at_ns{0};
  bool is_cycle_frozen{false};
  bool is_bus_frozen{false};
  bool level{false};
  int changes{0};
};

TEST(WatchdogLogic, ChangesItsLevelOnceAPeriod) {
  Watched watched(10 * kMs);
  watched.look_for(1000 * kMs);
  EXPECT_NEAR(watched.changes, 100, 2);
  EXPECT_FALSE(watched.logic.is_tripped());
}

TEST(WatchdogLogic, BeginsOnceTheCycleAdvances) {
  Watched watched(10 * kMs);
  watched.is_cycle_frozen = true;
  watched.look_for(1000 * kMs);
  EXPECT_EQ(watched.changes, 0);
  EXPECT_FALSE(watched.logic.is_tripped()) << "it held nothing yet";
  watched.is_cycle_frozen = false;
  watched.look_for(100 * kMs);
  EXPECT_GE(watched.changes, 8);
}

TEST(WatchdogLogic, NeedsNoThreadOfTheDevice) {
  Watched watched(10 * kMs);
  watched.view.bus_beats = 0;
  watched.is_bus_frozen = true;
  watched.look_for(1000 * kMs);
  EXPECT_NEAR(watched.changes, 100, 2);
}

TEST(WatchdogLogic, IsLowWithinThreePeriodsAnd20msOfTheLastProgress) {
  for (const std::int64_t period_ns : {2 * kMs, 10 * kMs, 50 * kMs, 1000 * kMs}) {
    for (std::int64_t phase_ns = 0; phase_ns < 2 * period_ns; phase_ns += std::max(2 * kMs, period_ns / 5)) {
      for (const bool is_cycle : {true, false}) {
        Watched watched(period_ns);
        watched.look_for(3 * period_ns + 100 * kMs + phase_ns);
        (is_cycle ? watched.is_cycle_frozen : watched.is_bus_frozen) = true;
        const std::int64_t frozen_at_ns = watched.now_ns;
        watched.look_for(5 * period_ns + 100 * kMs);
        EXPECT_FALSE(watched.level);
        EXPECT_TRUE(watched.logic.is_tripped());
        EXPECT_LE(watched.changed_at_ns - frozen_at_ns, 3 * period_ns + 20 * kMs)
            << period_ns << ' ' << phase_ns;
        EXPECT_STREQ(watched.logic.cause(),
                     is_cycle ? "the cycle stood still" : "the device's thread stood still");
      }
    }
  }
}

TEST(WatchdogLogic, FindsItselfTrippedAfterItWasHeldUp) {
  Watched watched(10 * kMs);
  watched.look_for(200 * kMs);
  watched.now_ns += 40 * kMs;  // the whole process stood still
  watched.look();
  EXPECT_TRUE(watched.logic.is_tripped());
  EXPECT_FALSE(watched.level);
  EXPECT_STREQ(watched.logic.cause(), "the thread that watches the lines stood still");
}

TEST(WatchdogLogic, AfterATripWaitsForClear) {
  Watched watched(10 * kMs);
  watched.look_for(200 * kMs);
  watched.is_cycle_frozen = true;
  watched.look_for(100 * kMs);
  watched.is_cycle_frozen = false;
  const int changes = watched.changes;
  watched.look_for(40 * kMs);
  EXPECT_TRUE(watched.logic.is_tripped()) << "until all have been seen to advance for a while";
  watched.look_for(1000 * kMs);
  EXPECT_FALSE(watched.logic.is_tripped());
  EXPECT_EQ(watched.changes, changes) << "nobody has withdrawn what it ran by";
  watched.look_for(10 * kMs, false);
  watched.look_for(100 * kMs, true);
  EXPECT_GE(watched.changes, changes + 8);
}

TEST(WatchdogLogic, StopsWithoutATripWhenThePowerIsToGo) {
  Watched watched(10 * kMs);
  watched.look_for(205 * kMs);
  watched.look(false);
  EXPECT_FALSE(watched.level);
  watched.is_cycle_frozen = true;
  watched.look_for(500 * kMs, false);
  EXPECT_FALSE(watched.logic.is_tripped());
  watched.look_for(500 * kMs, true);
  EXPECT_FALSE(watched.level) << "the cycle stands still";
  EXPECT_FALSE(watched.logic.is_tripped()) << "it held nothing";
}

TEST(WatchdogLogic, ALineThatFailsTripsIt) {
  Watched watched(10 * kMs);
  watched.look_for(200 * kMs);
  watched.logic.trip();
  EXPECT_TRUE(watched.logic.is_tripped());
  const int changes = watched.changes;
  watched.look_for(1000 * kMs);
  EXPECT_FALSE(watched.logic.is_tripped());
  EXPECT_LE(watched.changes, changes + 1);
  EXPECT_FALSE(watched.level);
}

}  // namespace
}  // namespace corbot::rt
