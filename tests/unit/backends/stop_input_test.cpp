// SPDX-License-Identifier: Apache-2.0
// Tests a controller that does not report its emergency stop input: it answers all other queries, or none.
#include <gmock/gmock.h>

#include <optional>

#include "unit/backends/fake_bus.h"
#include "unit/backends/serial_bench.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

/// A frame, and what the input says after it; nothing: the frame or the input ended in an error.
std::optional<StopInputLevel> exchange(Ssc32Bench& bench, DeviceCause* cause = nullptr) {
  try {
    bench.device.send(all_at(1500.0), false);
    const StopInputLevel input = bench.device.emergency_stop();
    (void)bench.device.measure(all_at(1500.0));
    bench.wire.pass(0.02);
    return input;
  } catch (const DeviceError& error) {
    if (cause != nullptr) *cause = error.cause();
  }
  return std::nullopt;
}

/// Returns true once the input has the level `wanted`.
bool comes_to(Ssc32Bench& bench, StopInputLevel wanted) {
  return wait_until([&] { return exchange(bench) == wanted; });
}

void expect_unheard(Ssc32Bench& bench, const char* fault) {
  ASSERT_EQ(bench.emulated.faults().execute({fault, "input", "on"}), "");
  EXPECT_EQ(exchange(bench), StopInputLevel::kReleased) << "one that is missing is no press";
  EXPECT_TRUE(comes_to(bench, StopInputLevel::kUnheard)) << fault;
  EXPECT_THAT(bench.device.drain_log(), HasSubstr("input B cannot be read"));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(exchange(bench), StopInputLevel::kUnheard) << "the position answers";
  EXPECT_TRUE(bench.device.has_answered());
  bench.emulated.faults().execute({fault, "input", "off"});
  EXPECT_TRUE(comes_to(bench, StopInputLevel::kReleased)) << fault;
}

TEST(Ssc32StopInput, IsUnheardThoughPositionsAnswer) {
  for (const int baud : {9600, 38400, 115200}) {
    for (const bool readback : {false, true}) {
      Ssc32Bench bench(Ssc32Model::kSsc32U, baud, readback, 'B');
      bench.emulated.set_input('B', false);
      bench.begin();
      expect_unheard(bench, baud == 9600 ? "garble" : baud == 38400 ? "half" : "deaf");
    }
  }
}

TEST(Ssc32StopInput, APositionThatDoesNotAnswerIsNotTakenForTheInput) {
  for (const bool is_pressed : {false, true}) {
    Ssc32Bench bench(Ssc32Model::kSsc32U, 115200, false, 'B');
    bench.emulated.set_input('B', false);
    bench.begin();
    bench.emulated.set_input('B', is_pressed);
    bench.emulated.faults().execute({"deaf", "position", "on"});
    const StopInputLevel wanted = is_pressed ? StopInputLevel::kPressed : StopInputLevel::kReleased;
    DeviceCause cause = DeviceCause::kNone;
    EXPECT_TRUE(wait_until([&] {
      const auto input = exchange(bench, &cause);
      EXPECT_EQ(input.value_or(wanted), wanted);
      return cause != DeviceCause::kNone;
    }));
    EXPECT_EQ(cause, DeviceCause::kNoAnswer) << "the input does not speak for the positions";
  }
}

TEST(Ssc32StopInput, APressThatIsHeardOnceLastsForSomeFrames) {
  Ssc32Bench bench(Ssc32Model::kSsc32U, 115200, false, 'B');
  bench.emulated.set_input('B', false);
  bench.begin();
  bench.emulated.set_input('B', true);
  EXPECT_EQ(exchange(bench), StopInputLevel::kPressed);
  bench.wire.garble = 1;  // the position
  EXPECT_EQ(exchange(bench), StopInputLevel::kPressed);
  bench.wire.lose = 2;
  EXPECT_EQ(exchange(bench), StopInputLevel::kPressed) << "and is not over by an answer that is missing";
}

TEST(Ssc32StopInput, ASilentControllerIsUnheardBeforeItIsLost) {
  Ssc32Bench bench(Ssc32Model::kSsc32U, 115200, false, 'B');
  bench.emulated.set_input('B', false);
  bench.begin();
  bench.wire.is_silent = true;
  int errors = 0;
  EXPECT_TRUE(wait_until([&] {
    const auto input = exchange(bench);
    errors += input ? 0 : 1;
    return input == StopInputLevel::kUnheard;
  }));
  EXPECT_LE(errors, 1);
}

TEST(StopInputWatch, CountsOnlyTheTimeThatItsThreadRan) {
  const auto at = [begin = Clock::now()](int ms) { return begin + std::chrono::milliseconds(ms); };
  StopInputWatch watch;
  watch.begin(at(0));
  EXPECT_TRUE(watch.is_due(at(0)));
  watch.note_miss(at(10'000));
  EXPECT_EQ(watch.look(), StopInputLevel::kReleased) << "one miss, whatever the clock says";
  watch.note(false, at(10'020));
  watch.note_miss(at(20'000));
  EXPECT_EQ(watch.look(), StopInputLevel::kReleased) << "one again";
  watch.note_miss(at(30'000));
  EXPECT_EQ(watch.look(), StopInputLevel::kUnheard) << "two";
  EXPECT_FALSE(watch.is_due(at(30'100)));
  EXPECT_TRUE(watch.is_due(at(30'500)));
  EXPECT_FALSE(watch.is_due(at(30'600))) << "asked just now";
  watch.note_miss(at(30'600));
  EXPECT_EQ(watch.look(), StopInputLevel::kUnheard);
  watch.note(false, at(31'000));
  for (int ms = 31'020; ms < 31'100; ms += 20) watch.note_miss(at(ms));
  EXPECT_EQ(watch.look(), StopInputLevel::kReleased) << "80 ms";
  watch.note_miss(at(31'100));
  EXPECT_EQ(watch.look(), StopInputLevel::kUnheard) << "100 ms";
}

class BusStopInputTest : public BusBackendTest {
 protected:
  [[nodiscard]] bool is_set(StopSource source) const {
    return (stop_.sources() & static_cast<std::uint32_t>(source)) != 0;
  }
};

TEST_F(BusStopInputTest, UnheardIsAPress) {
  bus_.has_stop_input = true;
  const auto backend = make();
  backend->open(frame(1));
  EXPECT_EQ(stop_.sources(), 0u);
  bus_.is_unheard = true;
  EXPECT_TRUE(wait_until([&] { return is_set(StopSource::kDeviceUnheard); }));
  EXPECT_EQ(stop_.presses(), 1u);
  EXPECT_FALSE(is_set(StopSource::kDevice));
  bus_.pressed = true;
  bus_.is_unheard = false;
  EXPECT_TRUE(wait_until([&] { return !is_set(StopSource::kDeviceUnheard); }));
  EXPECT_TRUE(is_set(StopSource::kDevice));
}

TEST_F(BusStopInputTest, ALostDeviceIsUnheardWhereItHasTheInput) {
  for (const bool has_stop_input : {false, true}) {
    bus_.has_stop_input = has_stop_input;
    bus_.fails = false;
    const auto backend = make();
    backend->open(frame(1));
    bus_.there = false;
    bus_.fails = true;
    ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; }));
    EXPECT_EQ(is_set(StopSource::kDeviceUnheard), has_stop_input);
    bus_.fails = false;
    bus_.there = true;
    EXPECT_TRUE(wait_until([&] { return stop_.sources() == 0; })) << "and heard again when it is back";
  }
}

}  // namespace
}  // namespace corbot::rt
