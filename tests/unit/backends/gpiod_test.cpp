// SPDX-License-Identifier: Apache-2.0
// Servo pulses on GPIO lines: where the edges are planned, and where they come.
#include "rt/backends/gpio/gpiod.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "support/cases.h"
#include "support/fake_gpio.h"

namespace corbot::rt {
namespace {

using test::FakeGpio;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kFrame_ns = 20'000'000;

template <class Condition>
bool wait_until(Condition&& condition) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

PulseWidths widths_of(std::initializer_list<std::int64_t> widths_us) {
  PulseWidths widths;
  for (const std::int64_t width_us : widths_us) widths.width_ns[widths.count++] = width_us * 1000;
  return widths;
}

TEST(PulsePlan, GivesEveryServoASlotOfItsOwn) {
  const PulsePlan plan = plan_pulses(widths_of({1500, 0, 2500, 600}), kFrame_ns, PulseOrder::kStaggered);
  ASSERT_EQ(plan.group_count, 3u);
  const std::array<std::int64_t, 3> rises{0, 10'000'000,
                                          15'000'000};  // the slot of a servo without pulse stays
  const std::array<std::int64_t, 3> falls{1'500'000, 2'500'000, 600'000};
  const std::array<std::uint32_t, 3> lines{0b1, 0b100, 0b1000};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(plan.groups[i].rise_ns, rises[i]);
    EXPECT_EQ(plan.groups[i].lines, lines[i]);
    ASSERT_EQ(plan.groups[i].fall_count, 1u);
    EXPECT_EQ(plan.groups[i].falls[0].after_ns, falls[i]);
  }
}

TEST(PulsePlan, SortsWhatFallsTogether) {
  const PulsePlan plan =
      plan_pulses(widths_of({1500, 600, 2500, 1500, 600}), kFrame_ns, PulseOrder::kTogether);
  ASSERT_EQ(plan.group_count, 1u);
  const PulseGroup& group = plan.groups[0];
  EXPECT_EQ(group.rise_ns, 0);
  EXPECT_EQ(group.lines, 0b11111u);
  ASSERT_EQ(group.fall_count, 3u);
  EXPECT_EQ(group.falls[0].lines, 0b10010u);
  EXPECT_EQ(group.falls[1].lines, 0b01001u);
  EXPECT_EQ(group.falls[2].lines, 0b00100u);
  EXPECT_EQ(plan_pulses({}, kFrame_ns, PulseOrder::kTogether).group_count, 0u);
}

TEST(PulsePlan, LowersEveryLineOnceAndInTime) {
  std::mt19937_64 random(test::drawn_seed());
  std::uniform_int_distribution<std::int64_t> width(-100, 3'000'000);
  for (int round = 0; round < 100'000; ++round) {
    PulseWidths widths;
    widths.count = static_cast<std::uint32_t>(1 + random() % 7);
    // Near ones too, which come together.
    const std::int64_t same = width(random);
    for (std::uint32_t i = 0; i < widths.count; ++i) {
      widths.width_ns[i] =
          random() % 3 == 0 ? same + static_cast<std::int64_t>(random() % 2000) : width(random);
    }
    const auto order = random() % 2 == 0 ? PulseOrder::kStaggered : PulseOrder::kTogether;
    const PulsePlan plan = plan_pulses(widths, kFrame_ns, order);
    std::uint32_t fallen = 0;
    std::int64_t free_ns = 0;
    for (std::uint32_t g = 0; g < plan.group_count; ++g) {
      const PulseGroup& group = plan.groups[g];
      ASSERT_GE(group.rise_ns, free_ns) << "pulses of two groups overlap";
      std::int64_t last_ns = 0;
      for (std::uint32_t f = 0; f < group.fall_count; ++f) {
        const auto& fall = group.falls[f];
        ASSERT_GT(fall.after_ns, last_ns);
        ASSERT_EQ(fallen & fall.lines, 0u);
        fallen |= fall.lines;
        last_ns = fall.after_ns;
        for (std::uint32_t i = 0; i < widths.count; ++i) {
          if ((fall.lines >> i & 1u) == 0) continue;
          ASSERT_LE(std::abs(fall.after_ns - std::min(widths.width_ns[i], kLongestPulse_ns)), kSameEdge_ns);
        }
      }
      free_ns = group.rise_ns + last_ns;
    }
    for (std::uint32_t i = 0; i < widths.count; ++i)
      EXPECT_EQ((fallen >> i & 1u) != 0, widths.width_ns[i] > 0);
    ASSERT_LE(free_ns, kFrame_ns);
  }
}

TEST(EdgeLateness, CountsIntoBuckets) {
  EdgeLateness lateness;
  for (const std::int64_t late_us : {0, 1, 3, 3, 7, 4999, 5000, 90'000}) lateness.count(late_us * 1000);
  EXPECT_EQ(lateness.bucket(0), 1u);
  EXPECT_EQ(lateness.bucket(1), 1u);
  EXPECT_EQ(lateness.bucket(2), 2u);
  EXPECT_EQ(lateness.bucket(EdgeLateness::kBuckets - 1), 2u);
  EXPECT_EQ(lateness.total(), 8u);
  EXPECT_EQ(lateness.longest_ns(), 90'000'000);
  EXPECT_EQ(
      lateness.text(),
      "8 pulses ended late by: <1 us 1, <2 us 1, <5 us 2, <10 us 1, <5000 us 1, more 2, at most 90000 us");
}

class GpiodTest : public ::testing::Test {
 protected:
  /// Pulse of one line: when it rose, and how long it was.
  struct Pulse {
    std::int64_t rose_ns;
    std::int64_t width_ns;
  };
  std::unique_ptr<Gpiod> make(PulseOrder order = PulseOrder::kStaggered) {
    return std::make_unique<Gpiod>(GpiodSettings{"fake", {"A", "B", "C"}, 50.0, order, 0, -1}, gpio_.chips());
  }
  static ServoFrame frame(double a_us, double b_us, double c_us) {
    ServoFrame frame;
    frame.servo_count = 3;
    frame.channel = {2, 0, 1};  // in another order than the lines
    frame.pulse_us = {c_us, a_us, b_us};
    return frame;
  }
  std::vector<Pulse> pulses(unsigned line) {
    std::vector<Pulse> found;
    bool was_high = false;
    for (const FakeGpio::Change& change : gpio_.changes()) {
      const bool is_high = (change.values >> line & 1u) != 0;
      if (is_high && !was_high) found.push_back({change.time_ns, -1});
      if (!is_high && was_high) found.back().width_ns = change.time_ns - found.back().rose_ns;
      was_high = is_high;
    }
    if (!found.empty() && found.back().width_ns < 0) found.pop_back();
    return found;
  }
  FakeGpio gpio_;
};

/// A machine that is busy delays edges; that it can be near enough is shown by the best of many.
constexpr std::int64_t kNear_ns = 300'000;
/// The instant at which lines change within a call that sets them varies by as much.
constexpr std::int64_t kSetVaries_ns = 2'000;

TEST_F(GpiodTest, MakesPulsesThatAreNeverTooShort) {
  for (const PulseOrder order : {PulseOrder::kStaggered, PulseOrder::kTogether}) {
    const auto device = make(order);
    EXPECT_THAT(device->open(), HasSubstr("3 servos, timed without real-time priority"));
    EXPECT_THAT(gpio_.last_request().lines, ::testing::ElementsAre("A", "B", "C"));
    const std::array<double, 3> wanted_us{1500.0, 700.0, 2300.0};
    const auto before = pulses(0).size();
    device->send(frame(wanted_us[0], wanted_us[1], wanted_us[2]), false);
    EXPECT_TRUE(wait_until([&] {
      for (unsigned line = 0; line < 3; ++line) {
        const auto wanted_ns = static_cast<std::int64_t>(wanted_us[line] * 1000);
        const auto made = pulses(line);
        if (made.size() < before + 5) return false;
        if (std::none_of(made.begin() + static_cast<std::ptrdiff_t>(before), made.end(),
                         [&](const Pulse& pulse) { return pulse.width_ns < wanted_ns + kNear_ns; })) {
          return false;
        }
      }
      return true;
    }));
    for (unsigned line = 0; line < 3; ++line) {
      for (const Pulse& pulse : pulses(line)) {
        EXPECT_GE(pulse.width_ns, static_cast<std::int64_t>(wanted_us[line] * 1000) - kSetVaries_ns) << line;
      }
    }
    EXPECT_GE(device->lateness().total(), 15u);
    device->close();
    EXPECT_EQ(gpio_.outputs(), 0u);
    EXPECT_THAT(device->drain_log(), HasSubstr("pulses ended late by"));
    EXPECT_EQ(device->drain_log(), "");
  }
}

TEST_F(GpiodTest, AllowsForTheTimeThatSettingLinesTakes) {
  constexpr auto kSetting = std::chrono::microseconds(15);
  constexpr std::int64_t kWanted_ns = 1'500'000;
  gpio_.take_to_set(kSetting);
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0, 1500.0), false);
  std::int64_t best_ns = 0;
  EXPECT_TRUE(wait_until([&] {
    const auto made = pulses(0);
    if (made.empty()) return false;
    best_ns = std::min_element(made.begin(), made.end(), [](const Pulse& a, const Pulse& b) {
                return a.width_ns < b.width_ns;
              })->width_ns;
    return best_ns < kWanted_ns + std::chrono::nanoseconds(kSetting).count() / 2;
  })) << best_ns;
  EXPECT_GE(best_ns, kWanted_ns - kSetVaries_ns);
}

TEST_F(GpiodTest, KeepsAnAbsoluteGrid) {
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0, 1500.0), false);
  ASSERT_TRUE(wait_until([&] { return pulses(0).size() >= 25; }));
  const auto first = pulses(0);
  const auto second = pulses(1);
  // Most rises are on the grid, some are late, and nothing drifts.
  // The median shows which instant the grid has.
  std::vector<std::int64_t> phases_ns;
  for (const Pulse& pulse : first) {
    const std::int64_t since_ns = pulse.rose_ns - first[0].rose_ns + kFrame_ns / 2;
    phases_ns.push_back(since_ns % kFrame_ns);
  }
  std::vector<std::int64_t> sorted_ns = phases_ns;
  std::sort(sorted_ns.begin(), sorted_ns.end());
  const std::int64_t grid_ns = sorted_ns[sorted_ns.size() / 2];
  const auto near = std::count_if(phases_ns.begin(), phases_ns.end(), [&](std::int64_t phase_ns) {
    return std::abs(phase_ns - grid_ns) < 2'000'000;
  });
  EXPECT_GE(near, static_cast<std::ptrdiff_t>(first.size() / 2));
  int staggered = 0;
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i) {
    const std::int64_t apart_ns = second[i].rose_ns - first[i].rose_ns;
    staggered += apart_ns > 1'500'000 && std::abs(apart_ns - kFrame_ns / 3) < 2'000'000 ? 1 : 0;
  }
  EXPECT_GE(staggered, static_cast<int>(first.size() / 2));
}

TEST_F(GpiodTest, SendsNothingBeforeItIsToldAndAfterItIsRelaxed) {
  const auto device = make();
  (void)device->open();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_TRUE(gpio_.changes().empty());
  device->send(frame(1500.0, 1500.0, 1500.0), false);
  ASSERT_TRUE(wait_until([&] { return pulses(2).size() >= 2; }));
  device->relax();
  std::size_t before = 0;
  EXPECT_TRUE(wait_until([&] {
    const std::size_t now = gpio_.changes().size();
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    before = now;
    return gpio_.changes().size() == before;
  }));
  EXPECT_EQ(gpio_.outputs(), 0u);
}

TEST_F(GpiodTest, SaysThatItsChipIsGone) {
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0, 1500.0), false);
  gpio_.unplug();
  DeviceCause cause{};
  ASSERT_TRUE(wait_until([&] {
    try {
      device->send(frame(1500.0, 1500.0, 1500.0), false);
    } catch (const DeviceError& error) {
      cause = error.cause();
      return true;
    }
    return false;
  }));
  EXPECT_EQ(cause, DeviceCause::kHungUp);
  device->close();
  EXPECT_THROW((void)device->open(), DeviceError);
  gpio_.plug();
  (void)device->open();
  const std::size_t before = pulses(0).size();
  device->send(frame(1500.0, 1500.0, 1500.0), false);
  EXPECT_TRUE(wait_until([&] { return pulses(0).size() > before; }));
}

TEST(KernelGpio, NamesAMissingChip) {
  try {
    (void)kernel_gpio()->info("/nonexistent/gpiochip0", "ESTOP");
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nonexistent/gpiochip0: No such file"));
  }
  EXPECT_THROW((void)kernel_gpio()->info("/dev/null", "3"), DeviceError) << "no GPIO chip";
  EXPECT_THROW((void)kernel_gpio()->outputs({.chip = "/dev/null", .lines = {"3"}}), DeviceError);
  EXPECT_THROW((void)kernel_gpio()->input({.chip = "/dev/null", .lines = {"3"}}), DeviceError);
}

}  // namespace
}  // namespace corbot::rt
