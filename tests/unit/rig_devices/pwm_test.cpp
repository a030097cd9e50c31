// SPDX-License-Identifier: Apache-2.0
// PWM of a real kernel: by sysfs, and by a PCA9685 on I2C (or i2c-stub, whose registers are only memory).
#include <gmock/gmock.h>

#include <filesystem>

#include "rig_devices/rig_device.h"
#include "rt/backends/pwm/pca9685.h"
#include "rt/backends/pwm/pwm_sysfs.h"

namespace corbot::test {
namespace {

using namespace rt;
namespace fs = std::filesystem;

ServoFrame frame_of(std::initializer_list<std::pair<std::uint32_t, double>> servos) {
  ServoFrame frame;
  for (const auto& [channel, pulse_us] : servos) {
    frame.channel[frame.servo_count] = channel;
    frame.pulse_us[frame.servo_count++] = pulse_us;
  }
  return frame;
}

class RigPwm : public ::testing::Test {
 protected:
  void SetUp() override {
    CORBOT_NEEDS("CORBOT_RIG_PWMCHIP");
    chip_ = rig("CORBOT_RIG_PWMCHIP");
  }
  [[nodiscard]] std::string of(int channel, const std::string& name) const {
    return line_of(chip_ + "/pwm" + std::to_string(channel) + "/" + name);
  }
  std::string chip_;
};

TEST_F(RigPwm, SetsWhatTheKernelReadsBack) {
  PwmSysfs device({chip_, {0, 1}, 50.0});
  std::cout << device.open() << std::endl;
  EXPECT_EQ(of(0, "period"), "20000000");
  device.send(frame_of({{0, 1500.0}, {1, 612.5}}), true);
  EXPECT_EQ(of(0, "duty_cycle"), "1500000");
  EXPECT_EQ(of(1, "duty_cycle"), "612500");
  EXPECT_EQ(of(0, "enable"), "1");
  EXPECT_EQ(of(0, "polarity"), "normal");
  device.close();
  EXPECT_EQ(of(0, "enable"), "1") << "holds";

  PwmSysfs again({chip_, {0, 1}, 50.0});
  (void)again.open();
  const BusReading reading = again.measure(frame_of({{0, 0.0}, {1, 0.0}}));
  ASSERT_EQ(reading.unit, BusReading::Unit::kPulses);
  EXPECT_EQ(reading.value[0], 1500.0);
  EXPECT_EQ(reading.value[1], 612.5);
  for (int i = 0; i < 100; ++i) again.send(frame_of({{0, 1000.0 + i}, {1, 2000.0 - i}}), false);
  EXPECT_EQ(of(0, "duty_cycle"), "1099000");
  again.relax();
  EXPECT_EQ(of(0, "enable"), "0");
  std::ofstream(chip_ + "/unexport") << 0 << std::endl;
  std::ofstream(chip_ + "/unexport") << 1 << std::endl;
}

TEST_F(RigPwm, GivesBackWhatItExported) {
  PwmSysfs device({chip_, {2}, 50.0});
  (void)device.open();
  device.send(frame_of({{2, 1500.0}}), true);
  EXPECT_TRUE(fs::exists(chip_ + "/pwm2"));
  device.relax();
  EXPECT_FALSE(fs::exists(chip_ + "/pwm2"));
}

TEST_F(RigPwm, TellsWhatTheControllerHasNot) {
  EXPECT_THROW((void)PwmSysfs({chip_, {1000}, 50.0}).open(), DeviceError);
  EXPECT_THROW((void)PwmSysfs({chip_ + "0000", {0}, 50.0}).open(), DeviceError);
}

class RigI2c : public ::testing::Test {
 protected:
  void SetUp() override {
    CORBOT_NEEDS("CORBOT_RIG_I2C");
    CORBOT_NEEDS("CORBOT_RIG_I2C_ADDRESS");
    bus_ = rig("CORBOT_RIG_I2C");
    address_ = static_cast<int>(std::strtol(rig("CORBOT_RIG_I2C_ADDRESS").c_str(), nullptr, 0));
    // As at power-up: asleep, at 200 Hz. A stub's registers are empty.
    I2cDev other(bus_, address_);
    other.open();
    put(other, 0x00, 0x11);
    put(other, 0xFE, 0x1E);
    for (std::uint8_t led = 0x06; led <= 0x42; led = static_cast<std::uint8_t>(led + 4)) {
      const std::array<std::uint8_t, 4> off{0, 0, 0, 0x10};
      other.write(led, off);
    }
  }
  static void put(I2cBus& bus, std::uint8_t number, std::uint8_t value) { bus.write(number, {&value, 1}); }
  [[nodiscard]] std::array<std::uint8_t, 8> registers(std::uint8_t first) const {
    I2cDev other(bus_, address_);
    other.open();
    std::array<std::uint8_t, 8> found{};
    other.read(first, found);
    return found;
  }
  std::string bus_;
  int address_{};
};

TEST_F(RigI2c, WritesWhatASecondHandleReadsBack) {
  Pca9685 device(std::make_unique<I2cDev>(bus_, address_), {});
  const std::string text = device.open();
  std::cout << text << std::endl;
  EXPECT_THAT(text, ::testing::HasSubstr("50.03 frames a second, 4.88 us a count"));
  EXPECT_EQ(registers(0xF8)[6], 121);  // a block may not go round from the last register to the first
  EXPECT_EQ(registers(0x00)[0] & 0x30, 0x20) << "awake, with auto-increment";
  device.send(frame_of({{4, 1500.0}, {5, 1000.0}}), false);
  EXPECT_EQ(registers(0x06 + 16), (std::array<std::uint8_t, 8>{0, 0, 307 & 0xFF, 307 >> 8, 0, 0, 205, 0}));
  const BusReading reading = device.measure(frame_of({{4, 0.0}, {5, 0.0}}));
  ASSERT_EQ(reading.unit, BusReading::Unit::kPulses);
  EXPECT_NEAR(reading.value[0], 1500.0, 2.45);
  EXPECT_NEAR(reading.value[1], 1000.0, 2.45);
  device.relax();
  EXPECT_EQ(registers(0x06 + 16)[3], 0x10) << "off";
}

TEST_F(RigI2c, NoticesAReset) {
  Pca9685 device(std::make_unique<I2cDev>(bus_, address_), {});
  (void)device.open();
  device.send(frame_of({{0, 1500.0}}), false);
  I2cDev other(bus_, address_);
  other.open();
  put(other, 0x00, 0x11);
  EXPECT_THROW(device.send(frame_of({{0, 1500.0}}), false), DeviceError);
}

}  // namespace
}  // namespace corbot::test
