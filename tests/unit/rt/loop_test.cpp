// SPDX-License-Identifier: Apache-2.0
#include "rt/loop.h"

#include <gtest/gtest.h>

#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <numeric>
#include <thread>

#include "corbot/channel/alarms.h"
#include "rt/rig.h"
#include "rt/wall_clock.h"

namespace {
std::atomic<std::int64_t> suspended_s{0};
}

/// In place of the C library's, for this program: a machine cannot be suspended for a test.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const long result = ::syscall(SYS_clock_gettime, clock, time);
  if (clock == CLOCK_BOOTTIME) time->tv_sec += suspended_s.load();
  return static_cast<int>(result);
}

namespace corbot::test::loop_test {
namespace {

/// Puts the rig's steps before those of the loop. A gap that a busy machine makes is no fault.
void follow_clock(Rig& rig) {
  rig.now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  rig.settings.liveness.gap_fault_ns = 60'000'000'000;
  rig.restart();
}

/// Clocks of a thread that is preempted for `stalls_ns[n]` before the n-th reading; each reading takes 100
/// ns.
struct StalledClocks {
  static constexpr std::int64_t kOffset_ns = 1'700'000'000'000'000'000;
  std::vector<std::int64_t> stalls_ns;
  std::int64_t now_ns = 5'000'000'000;
  std::size_t readings = 0;

  std::int64_t operator()(clockid_t clock) noexcept {
    now_ns += 100 + (readings < stalls_ns.size() ? stalls_ns[readings] : 0);
    ++readings;
    return clock == CLOCK_REALTIME ? now_ns + kOffset_ns : now_ns;
  }
};

TEST(WallClock, IsNotLaterByWhatPreemptedItsReading) {
  constexpr std::int64_t kStall_ns = 30'000'000;
  const auto error_ns = [](std::vector<std::int64_t> stalls_ns, std::size_t readings) {
    StalledClocks clocks{std::move(stalls_ns)};
    const std::int64_t error = rt::wall_offset_ns(clocks) - StalledClocks::kOffset_ns;
    EXPECT_EQ(clocks.readings, readings);
    return std::abs(error);
  };
  EXPECT_LE(error_ns({}, 3), 100) << "one reading, as a rule";
  EXPECT_LE(error_ns({0, kStall_ns}, 6), 100);
  EXPECT_LE(error_ns({0, 0, kStall_ns}, 6), 100);
  EXPECT_LE(error_ns({0, kStall_ns, 0, 0, kStall_ns}, 9), 100);
  EXPECT_LE(error_ns({0, kStall_ns, 0, 0, kStall_ns, 0, 0, kStall_ns / 10}, 9), kStall_ns / 10)
      << "the tightest of three: no more is tried in one cycle";
}

TEST(Loop, SortsLatenciesIntoTheirBuckets) {
  EXPECT_EQ(rt::latency_bucket(-5), 0u);
  EXPECT_EQ(rt::latency_bucket(999), 0u);
  for (std::size_t i = 0; i + 1 < kLatencyBuckets; ++i) {
    EXPECT_EQ(rt::latency_bucket(latency_edge_ns(i) - 1), i);
    EXPECT_EQ(rt::latency_bucket(latency_edge_ns(i)), i + 1);
  }
  EXPECT_EQ(rt::latency_bucket(std::int64_t{1} << 60), kLatencyBuckets - 1);
}

TEST(Loop, BringsTheMotionToRestBeforeItEnds) {
  Rig rig;
  follow_clock(rig);
  rig.step();
  const std::uint64_t id = rig.submit(rig.planner.move_joints(rig.start(), {}, {0.8, 1.2, 1.5, 0.5}, 0.0));
  rig.step(250);
  ASSERT_EQ(rig.snapshot.command_id, id);
  const std::uint64_t first_cycle = rig.snapshot.cycle;
  const std::uint32_t wake = rig.task->wake.load();

  rt::Loop loop(*rig.cycle, *rig.task, {rig.arm.period_ns, false, 0});
  const std::atomic<bool> stop{true};
  loop.run(stop);

  ASSERT_TRUE(rig.task->snapshot.load(rig.snapshot));
  EXPECT_EQ(rig.snapshot.command_id, 0u);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kEnded);
  EXPECT_NE(rig.task->wake.load(), wake);
  LoopDiagnostics diagnostics{};
  ASSERT_TRUE(rig.task->diagnostics.load(diagnostics));
  const std::uint64_t steps = rig.snapshot.cycle - first_cycle;
  EXPECT_EQ(diagnostics.cycles + 1, steps);  // the last one is not waited out
  EXPECT_EQ(std::accumulate(diagnostics.latency.begin(), diagnostics.latency.end(), std::uint64_t{0}), steps);
  EXPECT_EQ(diagnostics.overruns, rig.snapshot.overruns);
}

TEST(Loop, ASuspensionOfTheMachineIsAGap) {
  Rig rig;
  follow_clock(rig);
  rt::Loop loop(*rig.cycle, *rig.task, {rig.arm.period_ns, false, 0});
  std::atomic<bool> stop{false};
  std::thread running([&] { loop.run(stop); });
  Snapshot now{};
  const auto steps = [&](std::uint64_t count) {
    const std::uint64_t until = now.cycle + count;
    while (!rig.task->snapshot.load(now) || now.cycle < until) std::this_thread::yield();
  };
  steps(20);
  EXPECT_EQ(now.state, RtState::kStandby);
  suspended_s = 100;
  while (now.state != RtState::kError) steps(1);
  stop = true;
  running.join();
  suspended_s = 0;
  std::optional<AlarmEvent> alarm = rig.alarm();
  while (alarm && alarm->code != AlarmCode::kLoopGap) alarm = rig.alarm();
  ASSERT_TRUE(alarm);
  EXPECT_NEAR(alarm::gap_s(*alarm), 100.0, 50.0) << "and what the machine did besides";
}

TEST(Loop, KeepsToItsGridAndSkipsWhatItMissed) {
  Rig rig;
  follow_clock(rig);
  rig.step();
  const std::int64_t before_ns = rig.snapshot.time_ns;
  rig.submit(rig.planner.move_joints(rig.start(), {}, {0.8, 1.2, 1.5, 0.5}, 0.0));
  rig.step(250);
  const std::uint64_t first = rig.task->trace.next();
  rt::Loop loop(*rig.cycle, *rig.task, {rig.arm.period_ns, false, 0});
  const std::atomic<bool> stop{true};
  loop.run(stop);
  Snapshot last{};
  Snapshot next{};
  ASSERT_TRUE(rig.task->trace.read(first, last));
  EXPECT_GT(last.time_ns, before_ns);
  for (std::uint64_t i = first + 1; i < rig.task->trace.next(); ++i) {
    ASSERT_TRUE(rig.task->trace.read(i, next));
    const std::int64_t step_ns = next.time_ns - last.time_ns;
    EXPECT_EQ(step_ns % rig.arm.period_ns, 0);
    EXPECT_EQ(step_ns > rig.arm.period_ns, next.overruns > last.overruns);
    EXPECT_LE(next.overruns, last.overruns + 1);
    last = next;
  }
}

}  // namespace
}  // namespace corbot::test::loop_test
