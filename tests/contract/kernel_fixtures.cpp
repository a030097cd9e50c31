// SPDX-License-Identifier: Apache-2.0
// Devices of the kernel that runs the test, read from outside the backend. A handle of their own reads the
// registers of a PCA9685; the kernel's trace has every edge of GPIO lines. Environment variables name them,
// see docs/rig.md; without them these fixtures are missing.
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "contract/device_fixture.h"
#include "contract/output_log.h"
#include "contract/trace_pipe.h"

namespace corbot::test {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}
std::string missing_variable(const char* name) {
  return variable(name).empty() ? fmt::format("skipped: no {} on this machine, see docs/rig.md", name) : "";
}
void put(const std::string& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text << std::flush;
  if (!stream) throw std::runtime_error(file + ": cannot be written");
}

/// The outputs of a PCA9685, or of i2c-stub in its place, also while a driver has the address.
class Registers {
 public:
  static constexpr double kCount_us = 4.88;  // 25 MHz, prescaler 121

  void open(const std::string& bus, const std::string& address) {
    fd_ = ::open(bus.c_str(), O_RDWR | O_CLOEXEC);
    if (fd_ < 0 || ::ioctl(fd_, I2C_SLAVE_FORCE, std::strtol(address.c_str(), nullptr, 0)) < 0) {
      throw std::runtime_error(bus + ": cannot be used");
    }
  }
  ~Registers() {
    if (fd_ >= 0) ::close(fd_);
  }
  std::vector<double> pulses_us(std::size_t servos) const {
    constexpr std::uint8_t kFirst = 0x06;
    constexpr std::uint8_t kFullOff = 0x10;
    i2c_smbus_data data{};
    data.block[0] = static_cast<std::uint8_t>(4 * servos);
    i2c_smbus_ioctl_data request{I2C_SMBUS_READ, kFirst, I2C_SMBUS_I2C_BLOCK_DATA, &data};
    if (::ioctl(fd_, I2C_SMBUS, &request) < 0) throw std::runtime_error("the registers cannot be read");
    std::vector<double> values;
    for (std::size_t i = 0; i < servos; ++i) {
      const std::uint8_t* led = data.block + 1 + 4 * i;
      const int on = led[0] | (led[1] & 0x0F) << 8;
      const int off = led[2] | (led[3] & 0x0F) << 8;
      const int counts = (off - on) & 0x0FFF;
      values.push_back((led[3] & kFullOff) != 0 || counts == 0 ? kNone : counts * kCount_us);
    }
    return values;
  }

 private:
  int fd_{-1};
};

class RegisterFixture : public DeviceFixture {
 public:
  explicit RegisterFixture(const ArmModel& arm)
      : servos_(arm.dof + 1), log_(servos_, [this] { return now(); }) {}
  std::vector<Output> outputs() override { return log_.seen(); }
  std::vector<double> now() override { return registers_.pulses_us(servos_); }

 protected:
  void watch(const std::string& address) {
    registers_.open(variable("CORBOT_RIG_I2C"), address);
    log_.start();
  }
  static DeviceFacts register_facts() {
    DeviceFacts facts;
    facts.unit = Registers::kCount_us;
    facts.period_s = 0.020;
    facts.approach_speed = 400.0;
    return facts;
  }

 private:
  const std::size_t servos_;
  Registers registers_;
  OutputLog log_;
};

/// The backend's own handle by i2c-dev, and the registers behind it. i2c-stub cannot be pulled out.
class KernelPca9685Fixture final : public RegisterFixture {
 public:
  using RegisterFixture::RegisterFixture;
  [[nodiscard]] std::string missing() const override { return missing_variable("CORBOT_RIG_I2C"); }
  void set_up() override { watch(variable("CORBOT_RIG_I2C_ADDRESS")); }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format("[backend]\nkind = \"pca9685\"\n[backend.pca9685]\nbus = \"{}\"\naddress = {}\n",
                       variable("CORBOT_RIG_I2C"), variable("CORBOT_RIG_I2C_ADDRESS"));
  }
  [[nodiscard]] DeviceFacts facts() const override {
    DeviceFacts facts = register_facts();
    facts.at_end = "hold";
    facts.pluggable = false;
    return facts;
  }
  void unplug() override {}
  void plug() override {}
};

/// The kernel's PWM with its driver for the PCA9685, which cuts off what is no whole count.
/// Its plug is the driver.
class KernelPwmFixture final : public RegisterFixture {
 public:
  using RegisterFixture::RegisterFixture;
  ~KernelPwmFixture() override {
    if (is_unplugged_) plug();
  }
  [[nodiscard]] std::string missing() const override { return missing_variable("CORBOT_RIG_PWMCHIP"); }
  void set_up() override { watch(variable("CORBOT_RIG_PWM_I2C_ADDRESS")); }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format(
        "[backend]\nkind = \"pwm_sysfs\"\n[backend.pwm_sysfs]\nchip = \"{}\"\nat_end = \"relax\"\n",
        variable("CORBOT_RIG_PWMCHIP"));
  }
  [[nodiscard]] DeviceFacts facts() const override {
    DeviceFacts facts = register_facts();
    facts.unit = 2.0 * Registers::kCount_us;
    facts.at_end = "relax";
    return facts;
  }
  void unplug() override { drive(false); }
  void plug() override { drive(true); }

 private:
  void drive(bool bound) {
    namespace fs = std::filesystem;
    if (device_.empty()) {
      device_ = fs::canonical(variable("CORBOT_RIG_PWMCHIP") + "/device").filename().string();
    }
    put(std::string("/sys/bus/i2c/drivers/pca9685-pwm/") + (bound ? "bind" : "unbind"), device_);
    is_unplugged_ = !bound;
  }

  std::string device_;
  bool is_unplugged_{false};
};

/// Lines of a GPIO chip: the kernel notes the time of every edge.
class KernelGpioFixture final : public DeviceFixture {
 public:
  explicit KernelGpioFixture(const ArmModel& arm) : servos_(arm.dof + 1) {}
  [[nodiscard]] std::string missing() const override {
    if (variable("CORBOT_RIG_BOOT") != "counted") {
      return "skipped: the length of a pulse means nothing here; needs the rig with counted time";
    }
    return missing_variable("CORBOT_RIG_GPIOCHIP");
  }
  void set_up() override { edges_.open(variable("CORBOT_RIG_GPIOCHIP"), servos_); }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format(
        "[backend]\nkind = \"gpiod\"\n[backend.gpiod]\nchip = \"{}\"\nlines = [\"0\", \"1\", \"2\", \"3\", "
        "\"4\"]\n",
        variable("CORBOT_RIG_GPIOCHIP"));
  }
  [[nodiscard]] DeviceFacts facts() const override {
    DeviceFacts facts;
    facts.unit = kUnit_us;
    facts.noise = 0.5 * kUnit_us;
    facts.period_s = 0.020;
    facts.approach_speed = 400.0;
    facts.ends_with_its_program = true;
    facts.at_end = "relax";
    facts.pluggable = false;
    return facts;
  }
  void unplug() override {}
  void plug() override {}
  std::vector<Output> outputs() override { return edges_.pulses(); }
  std::vector<double> now() override { return edges_.latest(); }

 private:
  // Edges are traced in whole microseconds, and an interrupt may come between.
  static constexpr double kUnit_us = 8.0;

  const std::size_t servos_;
  TracePipe edges_;
};

template <class Kind>
DeviceFixtureKind kind(const std::string& name) {
  return {name, [](const ArmModel& arm, const std::string&) -> std::unique_ptr<DeviceFixture> {
            return std::make_unique<Kind>(arm);
          }};
}

}  // namespace

std::vector<DeviceFixtureKind> kernel_fixtures() {
  return {kind<KernelPca9685Fixture>("kernel_pca9685"), kind<KernelPwmFixture>("kernel_pwm_sysfs"),
          kind<KernelGpioFixture>("kernel_gpiod")};
}

}  // namespace corbot::test
