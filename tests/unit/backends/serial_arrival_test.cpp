// SPDX-License-Identifier: Apache-2.0
// When an approach has ended, by the device's word or by its time; and what a Maestro's settings ask for.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "rt/backends/serial/adapter_latency.h"
#include "support/paths.h"
#include "unit/backends/fake_bus.h"
#include "unit/backends/serial_bench.h"

namespace corbot::rt {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::optional<bool> has_arrived(auto& bench) {
  BusReading on_the_way;
  return bench.device.has_arrived(on_the_way);
}

/// How much later than its time an approach to 1800 us has ended by the device's word, in ms; nothing: the
/// device does not say.
template <class Any>
std::optional<int> ends_after_ms(Any& bench) {
  bench.device.send(all_at(1800.0), true);
  bench.wait_for_approach();
  for (int ms = 0; ms < 60'000; ms += 20) {
    const auto is_there = has_arrived(bench);
    if (!is_there) return std::nullopt;
    if (*is_there) return ms;
    bench.wire.pass(0.02);
  }
  return -1;
}

TEST(SerialArrival, IsAskedOfTheDevice) {
  MaestroBench maestro;
  maestro.begin(1200.0);
  EXPECT_EQ(ends_after_ms(maestro), 0);
}

TEST(SerialArrival, AMaestroSaysItsPulsesOnTheWay) {
  MaestroBench bench;
  bench.begin(1200.0);
  bench.device.send(all_at(1800.0), true);
  bench.wire.pass(1.0);
  BusReading on_the_way;
  EXPECT_EQ(bench.device.has_arrived(on_the_way), false);
  ASSERT_EQ(on_the_way.unit, BusReading::Unit::kPulses);
  EXPECT_GT(on_the_way.value[0], 1300.0);
  EXPECT_NEAR(on_the_way.value[0], bench.wire.pulse_us(0), 8.0) << "of the servo frame before";
}

/// As after a Stop on the way, while the line is disturbed.
TEST(SerialArrival, AMaestroTurnsBackWithoutAReply) {
  MaestroBench bench;
  bench.begin(1200.0);
  bench.device.send(all_at(1800.0), true);
  bench.wire.pass(1.0);
  bench.emulated.faults().execute({"deaf", "position", "on"});
  bench.device.send(all_at(1400.0), true);
  double fastest_us_per_s = 0.0;
  for (int i = 0; i < 250; ++i) {
    const double before_us = bench.wire.pulse_us(0);
    bench.wire.pass(0.02);
    fastest_us_per_s = std::max(fastest_us_per_s, std::abs(bench.wire.pulse_us(0) - before_us) / 0.02);
  }
  EXPECT_NEAR(bench.wire.pulse_us(0), 1400.0, 1.0);
  EXPECT_NEAR(fastest_us_per_s, 400.0, 15.0) << "the limits of the approach hold";
}

TEST(SerialArrival, AMaestroThatRestartsOnTheWayGetsNoOtherTarget) {
  MaestroBench bench;
  bench.begin(1200.0);
  bench.device.send(all_at(1800.0), true);
  bench.wire.pass(1.0);
  bench.emulated.power_cycle(bench.wire.now_ns);
  EXPECT_THROW((void)bench.device.send(all_at(1400.0), true), DeviceError);
  bench.wire.pass(0.1);
  EXPECT_EQ(bench.wire.pulse_us(0), 0.0);
}

TEST(SerialArrival, AHaltAfterAnApproachThatDidNotBeginMovesNothing) {
  MaestroBench bench;
  bench.begin(1200.0);
  bench.emulated.faults().execute({"deaf", "position", "on"});
  EXPECT_THROW((void)bench.device.send(all_at(1800.0), true), DeviceError);
  bench.emulated.faults().execute({"deaf", "position", "off"});
  bench.device.halt();
  bench.wire.pass(1.0);
  EXPECT_EQ(bench.wire.pulse_us(0), 1200.0);
}

TEST(SerialArrival, AMaestroThatIsSlowerThanItsLimitIsWaitedFor) {
  MaestroBench bench;
  bench.begin(1000.0);
  bench.device.send(all_at(1800.0), true);
  // A speed that another program has set meanwhile: the way takes longer.
  for (std::uint8_t i = 0; i < kServos; ++i) {
    const std::array<std::uint8_t, 4> slow{0x87, i, 8, 0};
    bench.emulated.receive(slow, bench.wire.now_ns);
  }
  bench.wait_for_approach();
  EXPECT_EQ(has_arrived(bench), false);
  for (int i = 0; i < 1000 && has_arrived(bench) == false; ++i) bench.wire.pass(0.02);
  EXPECT_EQ(has_arrived(bench), true);
  EXPECT_NEAR(bench.wire.pulse_us(0), 1800.0, 2.0) << "the last servo frame";
}

TEST(SerialArrival, AMaestroGainsAndLosesItsSpeedOnTheWay) {
  MaestroBench bench;
  bench.begin(1000.0);
  // Speeds that Control Center has left in the controller have no effect on the motion.
  for (std::uint8_t i = 0; i < kServos; ++i) {
    const std::array<std::uint8_t, 4> slow{0x89, i, 1, 0};
    bench.emulated.receive(slow, bench.wire.now_ns);
  }
  bench.device.send(all_at(1800.0), true);
  constexpr double kLook_s = 0.02;  // of the servo's frame
  double at_us = 1000.0;
  double speed_us_per_s = 0.0;
  double fastest_us_per_s = 0.0;
  double most_us_per_s2 = 0.0;
  for (std::int64_t ns = 0; ns < bench.device.approach_ns(); ns += 20'000'000) {
    bench.wire.pass(kLook_s);
    const double now_us = bench.wire.pulse_us(0);
    const double now_us_per_s = (now_us - std::exchange(at_us, now_us)) / kLook_s;
    most_us_per_s2 = std::max(most_us_per_s2,
                              std::abs(now_us_per_s - std::exchange(speed_us_per_s, now_us_per_s)) / kLook_s);
    fastest_us_per_s = std::max(fastest_us_per_s, now_us_per_s);
  }
  EXPECT_NEAR(at_us, 1800.0, 1.0);
  EXPECT_NEAR(fastest_us_per_s, 400.0, 15.0);
  EXPECT_LE(most_us_per_s2, 2500.0 + 2 * 0.25 / (kLook_s * kLook_s)) << "and the steps of 0.25 us";
  bench.device.send(all_at(1800.0), false);
  bench.device.send(all_at(1000.0), false);
  bench.wire.pass(0.04);
  EXPECT_EQ(bench.wire.pulse_us(0), 1000.0) << "the limits are of the approach only";
}

TEST(SerialArrival, AMaestroThatIsCutOffAtItsLimitsIsNamed) {
  MaestroBench bench(false, {.max_us = 1700.0});
  bench.begin(1200.0);
  EXPECT_NE(ends_after_ms(bench), -1);
  EXPECT_THAT(bench.device.drain_log(), HasSubstr("stops at 1700 us, short of 1800 us"));
}

TEST(SerialArrival, TimeDecidesWhereTheDeviceDoesNotSay) {
  MaestroBench deaf;
  deaf.begin(1200.0);
  deaf.emulated.faults().execute({"deaf", "position", "on"});
  EXPECT_EQ(has_arrived(deaf), std::nullopt);
}

TEST(SerialArrival, AMaestroThatRestartsOnTheWayIsLost) {
  MaestroBench bench;
  bench.begin(1200.0);
  bench.device.send(all_at(1800.0), true);
  bench.emulated.power_cycle(bench.wire.now_ns);
  EXPECT_THROW((void)has_arrived(bench), DeviceError);
}

class BusArrivalTest : public BusBackendTest {};

TEST_F(BusArrivalTest, TheDeviceIsOpenWhenItHasArrived) {
  const auto backend = make();
  backend->open(frame(1));
  bus_.approach_ns = 1'000'000'000;
  bus_.is_approaching = true;
  bus_.fails = true;
  ASSERT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kLost; }));
  bus_.fails = false;
  (void)clear(*backend, frame(2));
  ASSERT_TRUE(wait_until([&] { return approaches() >= 2; }));
  const auto begin = Clock::now();
  bus_.approach_ns = 1'000'000;  // its time is over soon
  const int opened = bus_.opened;
  EXPECT_TRUE(wait_until([&] { return bus_.opened > opened; })) << "one that never arrives is lost";
  EXPECT_NE(backend->health(), BackendHealth::kOpen);
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(20));
  bus_.is_approaching = false;
  (void)clear(*backend, frame(10));
  EXPECT_TRUE(wait_until([&] { return backend->health() == BackendHealth::kOpen; }));
}

TEST(MaestroBaud, TheByteThatShowsItIsSentOnlyWhereAskedFor) {
  MaestroBench bench;
  bench.begin();
  (void)bench.device.open();
  bench.wire.pass(0.1);
  EXPECT_EQ(bench.wire.pulse_us(0), 1500.0) << "the servos do not go home at an open";
  EXPECT_EQ(bench.wire.written.find('\xAA'), std::string::npos);
  MaestroBench detecting(false, {.detects_baud = true}, true);
  EXPECT_EQ(detecting.wire.written.front(), '\xAA');
  detecting.begin();
  EXPECT_EQ(detecting.wire.pulse_us(0), 1500.0);
}

/// As the thread that serves it does: asks on the way.
void approach(MaestroBench& bench, double pulse_us) {
  bench.device.send(all_at(pulse_us), true);
  for (std::int64_t ns = 0; ns < bench.device.approach_ns(); ns += 20'000'000) {
    (void)has_arrived(bench);
    bench.wire.pass(0.02);
  }
}

TEST(MaestroTimeout, IsNamedAndNoErrorOfTheNextApproach) {
  MaestroBench bench(false, {.timeout_ms = 500});
  approach(bench, 1500.0);
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(bench.cause_of(1500.0), DeviceCause::kNone) << "frames come often enough";
    bench.wire.pass(0.02);
  }
  bench.wire.pass(0.6);
  std::string why;
  EXPECT_EQ(bench.cause_of(1500.0, &why), DeviceCause::kDeviceFault);
  EXPECT_THAT(why, HasSubstr("serial timeout"));
  (void)bench.device.open();
  bench.wire.pass(0.6);
  bench.device.send(all_at(1500.0), true);
  EXPECT_THAT(bench.device.drain_log(), HasSubstr("begins at its last target"));
  bench.wait_for_approach();
}

TEST(MaestroTimeout, DoesNotPassWhileAnApproachIsUnderWay) {
  MaestroBench bench(false, {.errors_go_home = true, .timeout_ms = 500});
  approach(bench, 1000.0);
  approach(bench, 1900.0);
  EXPECT_EQ(bench.wire.pulse_us(0), 1900.0);
  EXPECT_EQ(bench.emulated.errors(), 0u);
}

TEST(AdapterLatency, IsReadWhereTheDriverHasIt) {
  const fs::path ttys = fs::path(CORBOT_SCRATCH_DIR) / ("latency." + std::to_string(::getpid()));
  fs::create_directories(ttys / "ttyUSB7" / "device");
  const fs::path tty = ttys / "ttyUSB7.node" / "ttyUSB7";
  fs::create_directories(tty.parent_path());
  std::ofstream(tty) << "";
  const fs::path link = ttys / "ssc32";
  fs::create_symlink(tty, link);
  EXPECT_EQ(latency_timer_ms(link, ttys), std::nullopt) << "no FTDI adapter";
  const auto expect = [&](const char* text, std::optional<int> wanted) {
    std::ofstream(ttys / "ttyUSB7" / "device" / "latency_timer") << text;
    EXPECT_EQ(latency_timer_ms(link, ttys), wanted) << text;
  };
  expect("16\n", 16);
  expect("1\n", 1);
  expect("-1\n", std::nullopt);
  expect("what\n", std::nullopt);
  EXPECT_EQ(latency_timer_ms("/nowhere/at/all", ttys), std::nullopt);
  fs::remove_all(ttys);
}

TEST(AdapterLatency, IsWarnedOfAndCountedInTheRate) {
  EXPECT_EQ(latency_warning(std::nullopt), "");
  EXPECT_EQ(latency_warning(2), "");
  EXPECT_THAT(latency_warning(16), HasSubstr("latency_timer"));
  EXPECT_EQ(Ssc32::shortest_period_ns(kServos, 115200, true, true, 1), 20'000'000);
  EXPECT_GT(Ssc32::shortest_period_ns(kServos, 115200, false, false, 16), 20'000'000);
  EXPECT_GT(Ssc32::shortest_period_ns(kServos, 115200, true, true, 16), 32'000'000)
      << "two answers, one after the other";
}

}  // namespace
}  // namespace corbot::rt
