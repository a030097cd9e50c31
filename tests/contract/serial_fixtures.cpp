// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <limits>
#include <stdexcept>
#include <utility>

#include "contract/device_fixture.h"
#include "support/emulated_controller.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

struct SerialDeviceKind {
  std::string name;
  std::vector<std::string> emulator;  ///< arguments of corbot-sim
  std::string backend;                ///< kind in the profile
  std::string options;                ///< more keys of its table
  DeviceFacts facts;
};

/// A controller that corbot-sim emulates on a pseudo-terminal.
class SerialFixture final : public DeviceFixture {
 public:
  SerialFixture(const SerialDeviceKind& kind, const ArmModel& arm, const std::string& directory)
      : kind_(kind),
        arm_(arm),
        controller_(std::string(CORBOT_BIN_DIR) + "/corbot-sim", kind.emulator, directory) {}
  ~SerialFixture() override { (void)controller_.stop(); }

  void set_up() override { controller_.start(); }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format("[backend]\nkind = \"{0}\"\n[backend.{0}]\nport = \"{1}\"\n{2}", kind_.backend,
                       controller_.line(), kind_.options);
  }
  [[nodiscard]] DeviceFacts facts() const override { return kind_.facts; }
  void unplug() override { controller_.command("unplug"); }
  void plug() override { controller_.command("plug"); }

  std::vector<Output> outputs() override {
    std::vector<Output> seen;
    for (const DeviceRow& row : controller_.rows())
      seen.push_back({row.time_ns, servo_of(row.channel), row.given});
    return seen;
  }
  std::vector<double> now() override {
    std::vector<double> values(arm_.dof + 1, std::numeric_limits<double>::quiet_NaN());
    for (const auto& [channel, pulse_us] : controller_.values("pulses"))
      values[servo_of(static_cast<std::uint32_t>(channel))] = pulse_us;
    return values;
  }

 private:
  [[nodiscard]] std::size_t servo_of(std::uint32_t channel) const {
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      if (arm_.servos[i].channel == channel) return i;
    }
    if (channel != arm_.gripper.channel)
      throw std::runtime_error(fmt::format("pulses at channel {}", channel));
    return arm_.dof;
  }

  const SerialDeviceKind kind_;
  const ArmModel arm_;
  EmulatedController controller_;
};

/// A controller that takes the servos one by one may begin the next frame to them when it has taken some.
constexpr double kServoFrame_s = 0.020;

DeviceFacts serial_facts(double unit_us, double period_s, double read_unit_us, std::string at_end,
                         double skew_s = 0.0) {
  DeviceFacts facts;
  facts.skew_s = skew_s;
  facts.unit = unit_us;
  facts.period_s = period_s;
  facts.approach_speed = 400.0;
  facts.read_unit = read_unit_us;
  facts.at_end = std::move(at_end);
  return facts;
}

}  // namespace

std::vector<DeviceFixtureKind> serial_fixtures() {
  // QP reports tens of microseconds, cut off, so it is off by up to a whole unit. The Mini SSC is an SSC-32
  // here, and rounds once more, to 1 us.
  // A plug that is pulled in the middle of a command is an error of the line to a Maestro.
  std::vector<SerialDeviceKind> kinds{
      {"ssc32", {"ssc32", "--model", "ssc32"}, "ssc32", "", serial_facts(1.0, 0.020, 0.0, "hold")},
      {"ssc32u",
       {"ssc32", "--model", "ssc32u"},
       "ssc32",
       "readback = true\nat_end = \"relax\"\n",
       serial_facts(1.0, 0.020, 20.0, "relax")},
      {"ssc32_slow_line",
       {"ssc32", "--model", "ssc32u", "--baud", "9600"},
       "ssc32",
       "baud = 9600\n",
       serial_facts(1.0, 0.0657, 0.0, "hold")},
      {"maestro",
       {"maestro", "--ignore-errors"},
       "maestro",
       "readback = true\nat_end = \"relax\"\nmulti_target = true\n",
       serial_facts(0.25, 0.020, 0.25, "relax")},
      {"maestro_micro",
       {"maestro", "--model", "micro", "--ignore-errors"},
       "maestro",
       "readback = true\nat_end = \"relax\"\n",
       serial_facts(0.25, 0.020, 0.25, "relax", kServoFrame_s)},
      {"maestro_checked",
       {"maestro", "--crc", "--ignore-errors"},
       "maestro",
       "device_number = 12\ncrc = true\nmulti_target = true\n",
       serial_facts(0.25, 0.020, 0.0, "hold")},
      {"minissc",
       {"ssc32", "--model", "ssc32", "--baud", "9600"},
       "minissc",
       "baud = 9600\n",
       serial_facts(2000.0 / 254.0 + 1.0, 0.020, 0.0, "", kServoFrame_s)}};
  std::vector<DeviceFixtureKind> fixtures;
  for (const SerialDeviceKind& kind : kinds) {
    fixtures.push_back({kind.name, [kind](const ArmModel& arm, const std::string& directory) {
                          return std::make_unique<SerialFixture>(kind, arm, directory);
                        }});
  }
  return fixtures;
}

/// Servos whose maps are in microseconds a millimetre.
std::vector<DeviceFixtureKind> sliding_fixtures() {
  std::vector<DeviceFixtureKind> fixtures;
  for (DeviceFixtureKind& kind : serial_fixtures()) {
    if (kind.name != "ssc32u" && kind.name != "maestro") continue;
    kind.profile = CORBOT_TEST_PROFILES "/servo_slides.toml";
    fixtures.push_back(std::move(kind));
  }
  return fixtures;
}

}  // namespace corbot::test
