// SPDX-License-Identifier: Apache-2.0
// The emergency stop's input and the servos' power: what counts as pressed, and when power may be on.
#include "rt/inputs/safety_lines.h"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "rt/inputs/stop_logic.h"
#include "support/fake_gpio.h"

namespace corbot::rt {
namespace {

using test::FakeGpio;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kMs = 1'000'000;
constexpr auto kGpio = static_cast<std::uint32_t>(StopSource::kGpio);

template <class Condition>
bool wait_until(Condition&& condition) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

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

TEST(PowerLogic, WaitsForTheDeviceAndForTheOperator) {
  PowerLogic logic(true);
  EXPECT_FALSE(logic.step(false, false, 0, 1, false));
  EXPECT_TRUE(logic.step(true, false, 0, 2, false));
  EXPECT_FALSE(logic.step(true, true, 1, 3, false)) << "pressed";
  EXPECT_FALSE(logic.step(true, false, 1, 3, false)) << "the cycle has not seen it yet";
  EXPECT_FALSE(logic.step(true, false, 1, 4, false)) << "what it published may be older than the press";
  EXPECT_FALSE(logic.step(true, false, 1, 6, true)) << "released, not cleared";
  EXPECT_TRUE(logic.step(true, false, 1, 7, false)) << "cleared";
  EXPECT_FALSE(logic.step(false, false, 1, 8, false));
}

TEST(PowerLogic, StaysOnWhereSoSet) {
  PowerLogic logic(false);
  EXPECT_TRUE(logic.step(true, true, 1, 1, true));
}

TEST(PowerLogic, CountsAPressThatWasOverBeforeItLooked) {
  PowerLogic logic(true);
  EXPECT_TRUE(logic.step(true, false, 0, 2, false));
  EXPECT_FALSE(logic.step(true, false, 1, 3, false));
  EXPECT_FALSE(logic.step(true, false, 1, 9, true));
  EXPECT_TRUE(logic.step(true, false, 1, 10, false)) << "cleared";
}

class SafetyLinesTest : public ::testing::Test {
 protected:
  std::unique_ptr<SafetyLines> make(bool with_stop = true, bool with_power = true) {
    SafetySettings settings;
    if (with_stop) settings.stop = GpioRequest{.chip = "fake", .lines = {"ESTOP"}, .active_low = true};
    if (with_power) settings.power = GpioRequest{.chip = "fake", .lines = {"SERVO_POWER"}};
    return std::make_unique<SafetyLines>(settings, gpio_.chips(), stop_, [this] {
      // A cycle that latches a stop until it is cleared.
      if (presses_seen_.exchange(stop_.presses()) != stop_.presses()) in_error_ = true;
      return CycleView{++cycle_, in_error_};
    });
  }
  /// Everything since the start.
  std::string logged(SafetyLines& lines) {
    const std::string log = to_string(lines.drain_log());
    if (!log.empty()) logged_ += log + "\n";
    return logged_;
  }
  FakeGpio gpio_;
  EmergencyStop stop_;
  std::atomic<std::uint64_t> cycle_{0};
  std::atomic<bool> in_error_{false};
  std::atomic<std::uint32_t> presses_seen_{0};
  std::string logged_;
};

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
  ASSERT_TRUE(wait_until([&] { return stop_.sources() == kGpio; }));
  ASSERT_TRUE(wait_until([&] { return logged(*lines).find("gone") != std::string::npos; }));
  gpio_.plug();
  EXPECT_TRUE(wait_until([&] { return stop_.sources() == 0; })) << "the cycle still waits for Clear";
  EXPECT_EQ(gpio_.requests(), 2);
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
