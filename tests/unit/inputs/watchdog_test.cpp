// SPDX-License-Identifier: Apache-2.0
// The watchdog output, by the thread that serves it, on lines in the hands of the test.
#include "inputs/safety_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class WatchdogTest : public SafetyLinesTest {
 protected:
  std::unique_ptr<SafetyLines> begin(bool with_power = true, bool off_at_stop = true) {
    SafetySettings with = settings(true, with_power);
    with.off_at_stop = off_at_stop;
    with.watchdog = GpioRequest{.chip = "watchdog", .lines = {"WATCHDOG"}};
    with.watchdog_period_ns = 20 * kMs;
    auto lines = make(with, board());
    lines->start();
    return lines;
  }
  std::size_t toggles() { return watchdog_.changes().size(); }
  /// With an operator who clears it, as often as a busy machine trips it.
  bool runs() {
    const std::size_t before = toggles();
    return wait_until([&] {
      if (stop_.sources() == 0) in_error_ = false;
      return toggles() >= before + 6 && watchdog_.outputs() == 1;
    });
  }
  /// Freezes a thread until the watchdog trips by it. On a busy machine the watcher itself may be late then,
  /// and trips by that.
  bool trips(SafetyLines& lines, std::atomic<bool>& is_frozen, const std::string& cause) {
    for (int i = 0; i < 30; ++i) {
      const std::size_t before = logged(lines).size();
      is_frozen = true;
      if (!wait_until([&] { return stop_.sources() == kWatchdog; })) return false;
      if (logged(lines).find("watchdog tripped: " + cause, before) != std::string::npos) return true;
      is_frozen = false;
      if (!wait_until([&] { return stop_.sources() == 0; }) || !runs()) return false;
    }
    return false;
  }
  bool has_power() { return power_.outputs() == 1; }
  /// For so many looks.
  bool is_silent(std::uint32_t looks = 300) {
    const std::size_t before = toggles();
    const std::uint32_t beats = stop_.beats();
    return wait_until([&] { return stop_.beats() > beats + looks; }) && toggles() == before &&
           watchdog_.outputs() == 0;
  }
};

TEST_F(WatchdogTest, TogglesWhileAllIsWell) {
  const auto lines = begin();
  EXPECT_TRUE(is_silent(30)) << "the device is not open";
  lines->allow_power();
  ASSERT_TRUE(runs());
  lines->stop();
  EXPECT_EQ(watchdog_.outputs(), 0u);
}

TEST_F(WatchdogTest, ACycleThatStandsStillTripsItAndTakesThePower) {
  const auto lines = begin();
  lines->allow_power();
  ASSERT_TRUE(runs());
  ASSERT_TRUE(wait_until([&] { return has_power() || !runs(); }));
  ASSERT_TRUE(trips(*lines, is_frozen_, "the cycle stood still"));
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 0; }))
      << "nothing is left that could slow the arm down";
  EXPECT_TRUE(is_silent());
  is_frozen_ = false;
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; })) << "all advance again";
  EXPECT_TRUE(is_silent()) << "which is not Clear";
  EXPECT_EQ(power_.outputs(), 0u);
  EXPECT_TRUE(in_error_);
  EXPECT_TRUE(runs());
  EXPECT_TRUE(wait_until([&] { return has_power() || !runs(); }));
}

TEST_F(WatchdogTest, ADevicesThreadThatStandsStillTripsIt) {
  const auto lines = begin();
  lines->allow_power();
  ASSERT_TRUE(runs());
  ASSERT_TRUE(trips(*lines, is_bus_frozen_, "the device's thread stood still"));
  EXPECT_TRUE(is_silent());
  is_bus_frozen_ = false;
  EXPECT_TRUE(runs());
}

TEST_F(WatchdogTest, AWatcherThatStandsStillTogglesNothingAndFindsItTripped) {
  const auto lines = begin();
  lines->allow_power();
  ASSERT_TRUE(runs());
  power_.block(true);  // a call to another chip does not return
  std::size_t before = 0;
  ASSERT_TRUE(wait_until([&] {  // ten periods without a change
    before = toggles();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    return toggles() == before;
  }));
  power_.block(false);
  ASSERT_TRUE(wait_until([&] { return (stop_.sources() & kWatchdog) != 0; }));
  EXPECT_TRUE(is_silent()) << "only Clear gives the power back";
  EXPECT_EQ(power_.outputs(), 0u);
}

TEST_F(WatchdogTest, AStopEndsItWithoutATrip) {
  const auto lines = begin(false);
  lines->allow_power();
  ASSERT_TRUE(runs());
  gpio_.press(true);
  ASSERT_TRUE(wait_until([&] { return (stop_.sources() & kGpio) != 0; }));
  ASSERT_TRUE(wait_until([&] { return watchdog_.outputs() == 0; }));
  EXPECT_TRUE(is_silent());
  gpio_.press(false);
  EXPECT_TRUE(is_silent()) << "released, not cleared";
  EXPECT_TRUE(runs());
}

/// Stop category 2: the power stays, so the charge pump must not take it either.
TEST_F(WatchdogTest, AStopThatLeavesThePowerOnLeavesItToggling) {
  const auto lines = begin(true, false);
  lines->allow_power();
  const auto is_tripped = [&] { return (stop_.sources() & kWatchdog) != 0; };
  bool goes_on = false;
  for (int i = 0; i < 30 && !goes_on; ++i) {  // a busy machine trips it
    gpio_.press(false);
    ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
    ASSERT_TRUE(runs());
    gpio_.press(true);
    ASSERT_TRUE(wait_until([&] { return (stop_.sources() & kGpio) != 0; }));
    const std::size_t before = toggles();
    ASSERT_TRUE(wait_until([&] { return is_tripped() || toggles() >= before + 20; }));
    goes_on = toggles() >= before + 20;
  }
  EXPECT_TRUE(goes_on);
  EXPECT_TRUE(in_error_);
  EXPECT_TRUE(has_power());
  is_frozen_ = true;
  ASSERT_TRUE(wait_until(is_tripped));
  EXPECT_TRUE(is_silent()) << "it still watches the cycle";
  is_frozen_ = false;
  gpio_.press(false);
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  EXPECT_TRUE(is_silent()) << "only Clear gives the power back";
  EXPECT_TRUE(runs());
}

TEST_F(WatchdogTest, ALineThatIsGoneTripsIt) {
  const auto lines = begin();
  lines->allow_power();
  ASSERT_TRUE(runs());
  watchdog_.unplug();
  ASSERT_TRUE(wait_until([&] { return (stop_.sources() & kWatchdog) != 0; }));
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 0; }));
  const int requests = watchdog_.requests();
  watchdog_.plug();
  ASSERT_TRUE(wait_until([&] { return watchdog_.requests() > requests; }));
  EXPECT_TRUE(runs());
  EXPECT_THAT(logged(*lines), HasSubstr("watchdog: its line cannot be switched: No such device"));
  EXPECT_THAT(logged(*lines), HasSubstr("watchdog: its line can be switched again"));
}

TEST_F(WatchdogTest, BeginsOnlyAfterAnInheritedErrorIsCleared) {
  in_error_ = true;
  const auto lines = begin();
  lines->allow_power();
  EXPECT_TRUE(is_silent());
  EXPECT_TRUE(runs());
}

}  // namespace
}  // namespace corbot::rt
