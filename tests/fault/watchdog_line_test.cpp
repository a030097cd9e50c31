// SPDX-License-Identifier: Apache-2.0
// The watchdog output of whole processes, on a simulated GPIO chip: when it toggles, and when no more.
#include <gmock/gmock.h>

#include <optional>

#include "fault/stop_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

class WatchdogLine : public StopRig {
 protected:
  static constexpr std::int64_t kPeriod_ns = 100'000'000;  // an emulated machine is slow
  static constexpr std::int64_t kBound_ns = 3 * kPeriod_ns + 20'000'000;

  void SetUp() override {
    if (const std::string why = why_no_gpio(); !why.empty()) GTEST_SKIP() << why;
    begin(true, stop_table() + table("watchdog", kWatchdogLine) + "period_ms = 100\n");
  }
  /// Its level has changed so often within 30 s, with an operator who clears what a busy machine trips.
  bool toggles(int changes) {
    bool last = is_high(kWatchdogLine);
    int seen = 0;
    return wait_until(within(30), [&] {
      const bool now = is_high(kWatchdogLine);
      seen += now != last ? 1 : 0;
      last = now;
      if (seen == 0) (void)raised_by([&] { arm_->Clear(); });
      return seen >= changes;
    });
  }
  /// Low and unchanged for ten periods.
  static bool is_silent() {
    for (const std::int64_t end_ns = now_ns() + 10 * kPeriod_ns; now_ns() < end_ns;) {
      if (is_high(kWatchdogLine)) return false;
      const timespec pause{0, 1'000'000};
      ::nanosleep(&pause, nullptr);
    }
    return true;
  }
  /// Its last change within two seconds from now: nothing: none.
  static std::optional<std::int64_t> last_change_after(std::int64_t begin_ns) {
    std::optional<std::int64_t> changed_ns;
    bool last = is_high(kWatchdogLine);
    while (now_ns() < begin_ns + 2'000'000'000) {
      const bool now = is_high(kWatchdogLine);
      if (now != last) changed_ns = now_ns() - begin_ns;
      last = now;
      const timespec pause{0, 200'000};
      ::nanosleep(&pause, nullptr);
    }
    return changed_ns;
  }
  void expect_that_it_ends(std::int64_t begin_ns, const std::string& what) {
    const std::int64_t after_ns = last_change_after(begin_ns).value_or(0);
    fmt::print("{}: last change after {} ms\n", what, after_ns / 1'000'000);
    EXPECT_LE(after_ns, kBound_ns) << what;
  }
};

TEST_F(WatchdogLine, TogglesUntilTheEnd) {
  ASSERT_TRUE(toggles(10));
  EXPECT_EQ(rt_->terminate(), 0) << rt_->errors();
  EXPECT_TRUE(is_silent());
  rt_.reset();
}

TEST_F(WatchdogLine, AFrozenCycleTripsItUntilClear) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  ASSERT_TRUE(toggles(4));
  {
    const TracedThread cycle(rt_->pid(), rt_->pid());
    expect_that_it_ends(now_ns(), "frozen cycle");
    EXPECT_FALSE(is_high(kWatchdogLine));
  }
  ASSERT_TRUE(wait_for(Corbot::Error));
  EXPECT_TRUE(is_silent()) << "the cycle runs again, which is not Clear";
  EXPECT_TRUE(toggles(4));
}

TEST_F(WatchdogLine, AFrozenTaskTogglesNothingUntilClear) {
  ASSERT_TRUE(toggles(4));
  rt_->signal(SIGSTOP);
  expect_that_it_ends(now_ns(), "SIGSTOP");
  rt_->signal(SIGCONT);
  ASSERT_TRUE(wait_for(Corbot::Error));
  EXPECT_TRUE(wait_until(within(30), [] { return !is_high(kWatchdogLine); }));
  EXPECT_TRUE(is_silent());
  EXPECT_TRUE(toggles(4));
}

TEST_F(WatchdogLine, ATaskThatTakesOverFromAKilledOneWaitsForClear) {
  ASSERT_TRUE(toggles(4));
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  expect_that_it_ends(now_ns(), "kill -9");
  start_rt();
  ASSERT_FALSE(HasFatalFailure());
  ASSERT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  EXPECT_TRUE(is_silent());
  EXPECT_TRUE(toggles(4));
}

TEST_F(WatchdogLine, APressEndsItUntilClear) {
  ASSERT_TRUE(toggles(4));
  press(true);
  ASSERT_TRUE(wait_for(Corbot::Error));
  EXPECT_TRUE(wait_until(within(30), [] { return !is_high(kWatchdogLine); }));
  press(false);
  EXPECT_TRUE(wait_until(within(30), [&] {
    const Corbot::DeviceInfo_var device = arm_->Device();
    return !device->emergencyStop;
  }));
  EXPECT_TRUE(wait_until(within(30), [&] { return is_silent(); }));
  EXPECT_TRUE(toggles(4));
}

}  // namespace
}  // namespace corbot::test
