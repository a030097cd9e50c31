// SPDX-License-Identifier: Apache-2.0
// Devices on this machine's own buses, emulated behind the interface that the backend has to the kernel; for
// those of a real kernel see kernel_fixtures.cpp.
#include <fmt/format.h>

#include <limits>

#include "contract/device_fixture.h"
#include "contract/output_log.h"
#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/gpio/gpiod.h"
#include "rt/backends/pwm/pca9685.h"
#include "support/chip_bus.h"
#include "support/fake_gpio.h"
#include "support/fake_pwm_chip.h"

namespace corbot::test {
namespace {

DeviceFacts pulse_facts(double unit_us, double read_unit_us, std::string at_end) {
  DeviceFacts facts;
  facts.unit = unit_us;
  facts.period_s = 0.020;
  facts.approach_speed = 400.0;
  facts.read_unit = read_unit_us;
  facts.at_end = std::move(at_end);
  return facts;
}

/// The channels of the Lynx 5 are those of the frame: joints, then the gripper.
class Pca9685Fixture final : public DeviceFixture {
 public:
  explicit Pca9685Fixture(const ArmModel& arm)
      : servos_(arm.dof + 1), log_(servos_, [this] { return look(); }) {}
  void set_up() override { log_.start(); }
  [[nodiscard]] std::string backend_section() const override {
    return "[backend]\nkind = \"pca9685\"\n[backend.pca9685]\nbus = \"/dev/i2c-1\"\n";
  }
  [[nodiscard]] DeviceFacts facts() const override { return pulse_facts(kCount_us, kCount_us, "relax"); }
  [[nodiscard]] std::unique_ptr<Backend> make(const Profile& profile, EmergencyStop& stop) override {
    rt::BusSettings settings;
    settings.name = "pca9685";
    settings.readback = true;
    settings.relax_at_end = true;
    return std::make_unique<rt::BusBackend>(
        profile.arm, std::make_unique<rt::Pca9685>(std::make_unique<ChipBus>(bus_), rt::Pca9685Settings{}),
        settings, stop);
  }
  void unplug() override { set_there(false); }
  void plug() override { set_there(true); }
  std::vector<Output> outputs() override { return log_.seen(); }
  std::vector<double> now() override { return look(); }

 private:
  static constexpr double kCount_us = 4.88;

  void set_there(bool there) {
    const std::lock_guard lock(bus_.mutex);
    bus_.is_there = there;
  }
  std::vector<double> look() {
    const std::lock_guard lock(bus_.mutex);
    std::vector<double> values;
    for (std::size_t i = 0; i < servos_; ++i) {
      const int counts = bus_.chip.high_counts(i);
      values.push_back(counts > 0 ? counts * kCount_us : std::numeric_limits<double>::quiet_NaN());
    }
    return values;
  }

  const std::size_t servos_;
  ChipBus::State bus_;
  OutputLog log_;
};

class PwmSysfsFixture final : public DeviceFixture {
 public:
  PwmSysfsFixture(const ArmModel& arm, const std::string& directory)
      : servos_(arm.dof + 1), chip_(directory), log_(servos_, [this] { return look(); }) {}
  void set_up() override { log_.start(); }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format(
        "[backend]\nkind = \"pwm_sysfs\"\n[backend.pwm_sysfs]\nchip = \"{}\"\nat_end = \"relax\"\n",
        chip_.chip().string());
  }
  [[nodiscard]] DeviceFacts facts() const override { return pulse_facts(0.001, 0.0, "relax"); }
  [[nodiscard]] std::unique_ptr<Backend> make(const Profile& profile, EmergencyStop& stop) override {
    chip_.settle();  // what the backend before this one has unexported
    return DeviceFixture::make(profile, stop);
  }
  void unplug() override { chip_.unplug(); }
  void plug() override { chip_.plug_in(); }
  std::vector<Output> outputs() override { return log_.seen(); }
  std::vector<double> now() override { return look(); }

 private:
  std::vector<double> look() {
    std::vector<double> values;
    for (std::size_t i = 0; i < servos_; ++i) {
      const int channel = static_cast<int>(i);
      const std::string duty_ns = chip_.of(channel, "duty_cycle");
      const bool is_on = chip_.of(channel, "enable") == "1" && !duty_ns.empty();
      values.push_back(is_on ? std::stod(duty_ns) * 1e-3 : std::numeric_limits<double>::quiet_NaN());
    }
    return values;
  }

  const std::size_t servos_;
  FakePwmChip chip_;
  OutputLog log_;
};

}  // namespace

std::vector<DeviceFixtureKind> pulse_fixtures() {
  return {
      {"pca9685",
       [](const ArmModel& arm, const std::string&) -> std::unique_ptr<DeviceFixture> {
         return std::make_unique<Pca9685Fixture>(arm);
       }},
      {"pwm_sysfs", [](const ArmModel& arm, const std::string& directory) -> std::unique_ptr<DeviceFixture> {
         return std::make_unique<PwmSysfsFixture>(arm, directory);
       }}};
}

}  // namespace corbot::test
