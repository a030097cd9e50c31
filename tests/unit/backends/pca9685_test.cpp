// SPDX-License-Identifier: Apache-2.0
// The PCA9685 backend against the rules of the chip.
#include "rt/backends/pwm/pca9685.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "support/chip_bus.h"
#include "unit/backends/fake_bus.h"

namespace corbot::rt {
namespace {

using test::ChipBus;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Pca9685Test : public ::testing::Test {
 protected:
  std::unique_ptr<Pca9685> make(Pca9685Settings settings = {}) {
    return std::make_unique<Pca9685>(std::make_unique<ChipBus>(bus_), settings);
  }
  static ServoFrame frame_of(std::initializer_list<std::pair<std::uint32_t, double>> servos) {
    ServoFrame frame;
    for (const auto& [channel, pulse_us] : servos) {
      frame.channel[frame.servo_count] = channel;
      frame.pulse_us[frame.servo_count++] = pulse_us;
    }
    return frame;
  }
  ChipBus::State bus_;
};

TEST_F(Pca9685Test, ComputesThePrescalerAndTellsTheRealRate) {
  EXPECT_EQ(Pca9685::prescale_for(25e6, 50.0), 121);
  EXPECT_EQ(Pca9685::prescale_for(25e6, 200.0), 30);  // what the chip has at power-up
  EXPECT_EQ(Pca9685::prescale_for(25e6, 1.0), 255);
  EXPECT_EQ(Pca9685::prescale_for(25e6, 1e6), 3);
  EXPECT_NEAR(Pca9685::count_us(25e6, 121), 4.88, 1e-9);
  EXPECT_EQ(Pca9685::counts_of(1500.0, 4.88), 307);
  EXPECT_EQ(Pca9685::counts_of(0.0, 4.88), 0);
  EXPECT_EQ(Pca9685::counts_of(std::nan(""), 4.88), 0);
  EXPECT_EQ(Pca9685::counts_of(1e9, 4.88), 4095);
  const auto device = make();
  EXPECT_EQ(device->open(), "PCA9685 on fake 0x40: 50.03 frames a second, 4.88 us a count");
  EXPECT_EQ(bus_.chip.reg(0xFE), 121);
  EXPECT_NEAR(static_cast<double>(device->period_ns()), 19'988'480.0, 1.0);
}

TEST_F(Pca9685Test, CorrectsForAnOscillatorThatIsOff) {
  const auto device = make({27e6, 50.0});
  (void)device->open();
  EXPECT_EQ(bus_.chip.reg(0xFE), 131);
  device->send(frame_of({{0, 1500.0}}), false);
  EXPECT_EQ(bus_.chip.high_counts(0), 307);  // 1500 / (132 / 27)
}

TEST_F(Pca9685Test, WritesNeighboursInOneBlock) {
  const auto device = make();
  (void)device->open();
  bus_.writes.clear();
  device->send(frame_of({{3, 1500.0}, {4, 1000.0}, {5, 2000.0}, {9, 500.0}, {8, 2500.0}}), false);
  EXPECT_THAT(bus_.writes,
              ElementsAre(std::pair(0x06 + 12, 12u), std::pair(0x06 + 36, 4u), std::pair(0x06 + 32, 4u)));
  for (const auto& [channel, pulse_us] :
       {std::pair{3u, 1500.0}, {4, 1000.0}, {5, 2000.0}, {9, 500.0}, {8, 2500.0}}) {
    EXPECT_NEAR(bus_.chip.high_counts(channel) * 4.88, pulse_us, 2.44 + 1e-9) << channel;
  }
  EXPECT_EQ(bus_.chip.high_counts(0), 0);
}

TEST_F(Pca9685Test, KeepsThePulsesWhenItFindsAnotherRate) {
  {
    const auto other = make({25e6, 60.0});
    (void)other->open();
    other->send(frame_of({{0, 1500.0}, {1, 900.0}}), false);
  }
  const auto device = make();
  EXPECT_THAT(device->open(), HasSubstr("it ran at 59.84 before: does another program use it?"));
  const BusReading reading = device->measure(frame_of({{0, 0.0}, {1, 0.0}}));
  ASSERT_EQ(reading.unit, BusReading::Unit::kPulses);
  EXPECT_NEAR(reading.value[0], 1500.0, 5.0);
  EXPECT_NEAR(reading.value[1], 900.0, 5.0);
  EXPECT_NEAR(bus_.chip.high_counts(0) * 4.88, 1500.0, 5.0) << "the pulses are there, not only the registers";
}

TEST_F(Pca9685Test, WakesAChipThatAnotherProgramPutToSleep) {
  {
    const auto other = make();
    (void)other->open();
    other->send(frame_of({{0, 1500.0}}), false);
    const std::uint8_t sleeps = 0x31;
    ASSERT_TRUE(bus_.chip.write(0x00, {&sleeps, 1}));
    ASSERT_EQ(bus_.chip.high_counts(0), 0);
  }
  const auto device = make();
  (void)device->open();
  EXPECT_EQ(bus_.chip.high_counts(0), 307) << "RESTART";
}

TEST_F(Pca9685Test, ReportsByServoWhatIsOff) {
  const auto device = make();
  (void)device->open();
  const ServoFrame asked = frame_of({{0, 0.0}, {1, 0.0}});
  BusReading reading = device->measure(asked);
  EXPECT_EQ(reading.unit, BusReading::Unit::kPulses);
  EXPECT_EQ(reading.value[0], 0.0);
  EXPECT_EQ(reading.value[1], 0.0);
  device->send(frame_of({{1, 1500.0}}), false);
  reading = device->measure(asked);
  EXPECT_EQ(reading.value[0], 0.0);
  EXPECT_NEAR(reading.value[1], 1500.0, 2.5);
}

TEST_F(Pca9685Test, RelaxesItsOwnOutputsOnly) {
  const auto device = make();
  (void)device->open();
  const std::array<std::uint8_t, 4> of_others{0, 0, 100, 0};
  ASSERT_TRUE(bus_.chip.write(0x06 + 4 * 7, of_others));
  device->send(frame_of({{0, 1500.0}, {1, 1500.0}}), false);
  device->relax();
  EXPECT_EQ(bus_.chip.high_counts(0), 0);
  EXPECT_EQ(bus_.chip.high_counts(1), 0);
  EXPECT_EQ(bus_.chip.high_counts(7), 100);
}

TEST_F(Pca9685Test, RelaxesAllThatHearIt) {
  const auto device = make();
  (void)device->open();
  const ServoFrame frame = frame_of({{0, 1500.0}, {1, 1500.0}, {2, 1500.0}});
  device->send(frame, false);
  bus_.chip.refuse_next(1);
  device->relax();
  for (const unsigned channel : {0u, 1u, 2u}) EXPECT_EQ(bus_.chip.high_counts(channel), 0) << channel;
  device->send(frame, false);
  bus_.chip.refuse_next(3);  // as often as one servo is tried
  EXPECT_THROW(device->relax(), DeviceError);
  EXPECT_NE(bus_.chip.high_counts(0), 0);
  EXPECT_EQ(bus_.chip.high_counts(1), 0);
  EXPECT_EQ(bus_.chip.high_counts(2), 0);
}

TEST_F(Pca9685Test, NoticesThatTheChipWasReset) {
  const auto device = make();
  (void)device->open();
  device->send(frame_of({{0, 1500.0}}), false);
  bus_.chip.power_cycle();
  try {
    device->send(frame_of({{0, 1500.0}}), false);
    FAIL() << "a chip that sleeps sends no pulses";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kDeviceFault);
    EXPECT_THAT(error.what(), HasSubstr("was reset"));
  }
}

TEST_F(Pca9685Test, RefusesWhatIsNoPca9685) {
  /// Registers that read as nothing.
  class Empty final : public I2cBus {
   public:
    void open() override {}
    void close() noexcept override {}
    [[nodiscard]] const std::string& name() const noexcept override { return name_; }
    void write(std::uint8_t, std::span<const std::uint8_t>) override {}
    void read(std::uint8_t, std::span<std::uint8_t> into) override { std::fill(into.begin(), into.end(), 0); }

   private:
    const std::string name_{"empty"};
  };
  Pca9685 device(std::make_unique<Empty>(), {});
  EXPECT_THROW((void)device.open(), DeviceError);
  EXPECT_THROW(I2cDev("/dev/null", 0x40).open(), DeviceError);
  EXPECT_THROW(I2cDev("/nonexistent/i2c", 0x40).open(), DeviceError);
}

TEST_F(Pca9685Test, PassesOnWhatTheBusSays) {
  const auto device = make();
  (void)device->open();
  bus_.chip.refuse_next(1);
  try {
    device->send(frame_of({{0, 1500.0}}), false);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kNoAnswer) << "may pass";
  }
  device->send(frame_of({{0, 1500.0}}), false);
  EXPECT_EQ(bus_.chip.high_counts(0), 307);
  bus_.is_there = false;
  EXPECT_THROW(device->send(frame_of({{0, 1500.0}}), false), DeviceError);
}

TEST_F(Pca9685Test, OneAddressWithoutAcknowledgeIsNoLossAndThreeInARowAre) {
  ArmModel arm;
  arm.dof = 1;
  arm.servos[0] = {0, 1500.0, 600.0, 1.0, 500.0, 2500.0};
  arm.gripper = {1, 1900.0, 1100.0, 0.5};
  EmergencyStop stop;
  BusBackend backend(arm, make(), {"pca9685"}, stop);
  ServoFrame first = frame_of({{0, 1500.0}, {1, 1900.0}});
  first.cycle = 1;
  backend.open(first);
  const auto let_miss = [&](int count) {
    const std::lock_guard lock(bus_.mutex);
    bus_.absent_next = count;
  };
  const auto led_writes = [&] {
    const std::lock_guard lock(bus_.mutex);
    return bus_.absent_next > 0 ? -1 : bus_.chip.led_writes();
  };
  for (const int count : {1, 2}) {
    const int before = led_writes();
    let_miss(count);
    ASSERT_TRUE(wait_until([&] { return led_writes() > before; })) << count;
    EXPECT_NE(backend.health(), BackendHealth::kLost) << count;
  }
  let_miss(3);
  ASSERT_TRUE(wait_until([&] { return backend.health() == BackendHealth::kLost; }));
  EXPECT_EQ(backend.cause(), DeviceCause::kNoAnswer);
}

TEST_F(Pca9685Test, IsNotThereAtTheStartWithoutAcknowledge) {
  bus_.absent_next = 1;
  const auto device = make();
  try {
    (void)device->open();
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kNotThere);
  }
}

}  // namespace
}  // namespace corbot::rt
