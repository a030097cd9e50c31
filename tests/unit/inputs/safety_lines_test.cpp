// SPDX-License-Identifier: Apache-2.0
// The emergency stop's input and the servos' power, by the thread that serves them.
#include "inputs/safety_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

TEST_F(SafetyLinesTest, StopsAndSwitchesOff) {
  const auto lines = make();
  lines->start();
  EXPECT_EQ(stop_.sources(), 0u);
  EXPECT_EQ(gpio_.outputs(), 0u) << "no power before the device is open";
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  gpio_.press(true);
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
  gpio_.press(false);
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  const std::uint64_t released_in = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > released_in + 10; }));
  EXPECT_EQ(gpio_.outputs(), 0u) << "releasing it switches nothing on";
  in_error_ = false;  // Clear
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  lines->stop();
  EXPECT_EQ(gpio_.changes().back().values, 0u);
  EXPECT_THAT(logged(*lines), HasSubstr("emergency stop pressed\n"));
  EXPECT_THAT(logged(*lines), HasSubstr("servo power off\n"));
}

TEST_F(SafetyLinesTest, DoesNotWaitUntilItsLogIsDrained) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; })) << i;
    stop_.set(StopSource::kDevice, true);
    ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 0; })) << i;
    stop_.set(StopSource::kDevice, false);
    in_error_ = false;  // Clear
  }
  EXPECT_EQ(lines->drain_log().size(), SafetyLines::kMaxLogLines) << "the rest was dropped";
}

TEST_F(SafetyLinesTest, TriesAgainToSwitchOff) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  gpio_.fail_sets(5);
  stop_.set(StopSource::kDevice, true);
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
  EXPECT_EQ(gpio_.requests(), 1);
  lines->stop();
  EXPECT_THAT(logged(*lines), HasSubstr("servo power cannot be switched OFF: Input/output error"));
  EXPECT_THAT(logged(*lines), HasSubstr("servo power off\n"));
}

TEST_F(SafetyLinesTest, AsksAnOutputsChipAgainThatWasGone) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  gpio_.unplug();
  stop_.set(StopSource::kDevice, true);
  ASSERT_TRUE(wait_until([&] { return logged(*lines).find("OFF: No such device") != std::string::npos; }));
  EXPECT_EQ(gpio_.outputs(), 1u);
  EXPECT_EQ(logged(*lines).find("servo power off"), std::string::npos) << "it is not";
  gpio_.plug();
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
  stop_.set(StopSource::kDevice, false);
  in_error_ = false;  // Clear
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
}

TEST_F(SafetyLinesTest, TriesAgainToSwitchOffAtTheEnd) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  gpio_.fail_sets(3);
  lines->stop();
  ASSERT_FALSE(gpio_.changes().empty());
  EXPECT_EQ(gpio_.changes().back().values, 0u) << "before the line was given back";
}

TEST_F(SafetyLinesTest, MissesNoShortPress) {
  const auto lines = make(true, false);
  lines->start();
  ASSERT_EQ(stop_.sources(), 0u);
  gpio_.tap();
  const auto tapped = Clock::now();
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  EXPECT_GE(Clock::now() - tapped, std::chrono::nanoseconds(StopLogic::kGoodAfter_ns));
}

TEST_F(SafetyLinesTest, LooksAtTheLevelThoughNoEdgeIsSeen) {
  gpio_.miss_edges();
  const auto lines = make(true, false);
  lines->start();
  ASSERT_EQ(stop_.sources(), 0u);
  gpio_.press(true);
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
}

TEST_F(SafetyLinesTest, IsPressedFromTheStart) {
  gpio_.press(true);
  const auto lines = make();
  lines->start();
  EXPECT_EQ(stop_.sources(), kGpio) << "when start() returns";
  lines->allow_power();
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
  EXPECT_EQ(gpio_.outputs(), 0u);
}

TEST_F(SafetyLinesTest, TakesAChipThatIsGoneForPressed) {
  const auto lines = make(true, false);
  lines->start();
  ASSERT_EQ(stop_.sources(), 0u);
  gpio_.unplug();
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpioUnheard; }));
  ASSERT_TRUE(wait_until([&] { return logged(*lines).find("gone") != std::string::npos; }));
  gpio_.plug();
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == 0; })) << "the cycle still waits for Clear";
  EXPECT_EQ(stop_.presses(), 1u);
  EXPECT_EQ(gpio_.requests(), 2);
}

TEST_F(SafetyLinesTest, TellsAButtonFromAChipThatIsGone) {
  const auto lines = make(true, false);
  lines->start();
  gpio_.press(true);
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
  gpio_.unplug();
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == (kGpio | kGpioUnheard); }));
  gpio_.plug();
  ASSERT_TRUE(wait_until([&] { return gpio_.requests() == 2; }));
  gpio_.press(false);
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
}

TEST_F(SafetyLinesTest, TakesThePowerWhenTheStopsChipIsGone) {
  is_frozen_ = true;  // and nothing but its own clock does it
  const auto fast = [] {
    SafetySettings result = settings(true, true);
    result.ramp_ns = 30 * kMs;
    return result;
  }();
  const auto lines = make(fast, board());
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  gpio_.unplug();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 0; }));
  const auto off = power_.changes().back();
  is_frozen_ = false;
  gpio_.plug();
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; })) << "it is back";
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
  EXPECT_EQ(power_.outputs(), 0u) << "only Clear gives it back";
  EXPECT_EQ(power_.changes().back().time_ns, off.time_ns);
  in_error_ = false;  // Clear
  EXPECT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
}

TEST_F(SafetyLinesTest, TakesThePowerThoughItsLineIsOnTheChipThatIsGone) {
  const auto lines = make();
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  gpio_.unplug();
  ASSERT_TRUE(wait_until([&] { return logged(*lines).find("OFF: No such device") != std::string::npos; }));
  EXPECT_EQ(stop_.sources(), kGpioUnheard);
  EXPECT_EQ(logged(*lines).find("servo power off"), std::string::npos) << "it is not";
  gpio_.plug();
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
  EXPECT_EQ(gpio_.outputs(), 0u) << "its chip is back, which is not Clear";
  in_error_ = false;  // Clear
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
}

TEST_F(SafetyLinesTest, NoticesAPowerSwitchThatIsGoneBeforeItIsNeeded) {
  for (const bool off_at_stop : {true, false}) {
    SafetySettings with = settings(false, true);
    with.off_at_stop = off_at_stop;
    in_error_ = false;
    const auto lines = make(with, board());
    lines->start();
    lines->allow_power();
    ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
    power_.unplug();
    ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpioUnheard; })) << off_at_stop;
    power_.plug();
    ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
    const std::uint64_t now = cycle_;
    ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
    EXPECT_EQ(power_.outputs(), 0u) << "it was off while its chip was gone";
    in_error_ = false;  // Clear
    EXPECT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  }
}

TEST_F(SafetyLinesTest, LeavesThePowerOnAtAStopWhereSoSet) {
  SafetySettings with = settings(true, true);
  with.off_at_stop = false;
  with.category = 0;
  const auto lines = make(with, board());
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  gpio_.press(true);
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 100; }));
  EXPECT_EQ(power_.outputs(), 1u);
  EXPECT_EQ(power_.changes().size(), 1u);
}

TEST_F(SafetyLinesTest, BouncesCountOnceAndThePowerStaysOff) {
  SafetySettings with = settings(true, true);
  with.category = 0;
  const auto lines = make(with, board());
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  for (int i = 0; i < 40; ++i) gpio_.press(i % 2 == 0);
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 0; }));
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == 0; }));
  EXPECT_EQ(power_.outputs(), 0u);
  EXPECT_EQ(power_.changes().size(), 2u);
}

/// Whatever state its lines are in: each look is a beat.
TEST_F(SafetyLinesTest, BeatsWithEachLook) {
  const auto beats = [&] {
    const std::uint32_t before = stop_.beats();
    const std::uint64_t looks = cycle_;
    const bool goes_on = wait_until([&] { return cycle_ > looks + 30; });
    return goes_on && stop_.beats() - before >= 25u;
  };
  const auto lines = make(settings(true, true), board());
  EXPECT_EQ(stop_.beats(), 0u) << "nothing is watched yet";
  lines->start();
  lines->allow_power();
  EXPECT_TRUE(beats());
  gpio_.press(true);
  EXPECT_TRUE(beats()) << "pressed";
  gpio_.unplug();
  power_.unplug();
  EXPECT_TRUE(beats()) << "its chips are gone";
  gpio_.plug();
  power_.plug();
  ASSERT_TRUE(wait_until([&] { return gpio_.requests() == 2; }));
  EXPECT_TRUE(beats());
  lines->stop();
  const std::uint32_t last = stop_.beats();
  const auto idle = make(settings(false, false), board());
  idle->start();
  EXPECT_EQ(stop_.beats(), last) << "no thread, and none that could stand still";
}

TEST_F(SafetyLinesTest, ACallToAChipThatBlocksIsNoBeat) {
  const auto lines = make(settings(true, true), board());
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  power_.block(true);
  std::uint32_t beats = stop_.beats();
  // It stands still for ten times as long as a look takes.
  ASSERT_TRUE(wait_until([&] {
    const std::uint32_t before = stop_.beats();
    std::this_thread::sleep_for(10 * std::chrono::nanoseconds(SafetyLines::kLook_ns));
    beats = stop_.beats();
    return beats == before;
  }));
  power_.block(false);
  EXPECT_TRUE(wait_until([&] { return stop_.beats() > beats + 5; }));
}

TEST_F(SafetyLinesTest, AStartIsOverWhenItsThreadHasLooked) {
  const auto lines = make(settings(true, true), board());
  lines->start();
  EXPECT_GE(stop_.beats(), 2u) << "one says that it is demanded";
  EXPECT_EQ(stop_.sources() & kWatcher, 0u);
}

TEST_F(SafetyLinesTest, AThreadThatBlocksInItsFirstLookIsAPressFromTheStartOn) {
  power_.block_sets(true);
  const auto lines = make(settings(false, true), board());
  lines->start();
  EXPECT_EQ(stop_.sources(), kWatcher);
  EXPECT_EQ(stop_.presses(), 1u);
  EXPECT_EQ(stop_.beats(), 1u) << "the cycle demands it";
  EXPECT_THAT(logged(*lines), HasSubstr("has not read them in time"));
  power_.block_sets(false);
  EXPECT_TRUE(wait_until([&] { return stop_.beats() > 1; }));
}

TEST_F(SafetyLinesTest, TakesThePowerWhereCycleAndDevicesThreadStandStill) {
  const auto lines = make(settings(false, true), board());
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 1; }));
  is_bus_frozen_ = is_frozen_ = true;
  ASSERT_TRUE(wait_until([&] { return power_.outputs() == 0; }));
  EXPECT_EQ(stop_.presses(), 1u) << "which the cycle latches when it goes on";
  EXPECT_EQ(stop_.sources(), static_cast<std::uint32_t>(StopSource::kDeviceUnheard));
  is_bus_frozen_ = is_frozen_ = false;
  const std::uint64_t cycle = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > cycle + 20; }));
  stop_.set(StopSource::kDeviceUnheard, false);  // as its thread does
  ASSERT_TRUE(wait_until([&] { return cycle_ > cycle + 60; }));
  EXPECT_EQ(power_.outputs(), 0u) << "no Clear";
}

TEST_F(SafetyLinesTest, SwitchesOffAtTheStopOfADevice) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  stop_.set(StopSource::kDevice, true);
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
}

TEST_F(SafetyLinesTest, SwitchesOffAtAPressBetweenTwoLooks) {
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  ASSERT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
  stop_.set(StopSource::kDevice, true);
  stop_.set(StopSource::kDevice, false);
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 0; }));
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
  EXPECT_EQ(gpio_.outputs(), 0u);
}

TEST_F(SafetyLinesTest, GivesNoPowerToAnArmThatIsInErrorFromTheStart) {
  in_error_ = true;
  const auto lines = make(false, true);
  lines->start();
  lines->allow_power();
  const std::uint64_t now = cycle_;
  ASSERT_TRUE(wait_until([&] { return cycle_ > now + 10; }));
  EXPECT_EQ(gpio_.outputs(), 0u);
  in_error_ = false;  // Clear
  EXPECT_TRUE(wait_until([&] { return gpio_.outputs() == 1; }));
}

TEST_F(SafetyLinesTest, RefusesToStartWithoutItsChip) {
  gpio_.unplug();
  EXPECT_THROW(make()->start(), DeviceError);
}

TEST_F(SafetyLinesTest, DoesNothingWhereThereIsNeither) {
  const auto lines = make(false, false);
  lines->start();
  lines->allow_power();
  EXPECT_EQ(gpio_.requests(), 0);
}

}  // namespace
}  // namespace corbot::rt
