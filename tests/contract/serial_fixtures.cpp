// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "contract/device_fixture.h"
#include "support/process.h"

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
  SerialFixture(SerialDeviceKind kind, const ArmModel& arm, std::string directory)
      : kind_(std::move(kind)), arm_(arm), directory_(std::move(directory)) {}

  void set_up() override {
    std::vector<std::string> command{std::string(CORBOT_BIN_DIR) + "/corbot-sim"};
    command.insert(command.end(), kind_.emulator.begin(), kind_.emulator.end());
    command.insert(command.end(), {"--pty", line(), "--record", record()});
    emulator_ = std::make_unique<Process>(command);
    if (!emulator_->wait_line("ready", within(30))) throw std::runtime_error(emulator_->errors());
  }
  ~SerialFixture() override {
    if (emulator_) (void)emulator_->terminate();
  }
  [[nodiscard]] std::string backend_section() const override {
    return fmt::format("[backend]\nkind = \"{0}\"\n[backend.{0}]\nport = \"{1}\"\n{2}", kind_.backend, line(),
                       kind_.options);
  }
  [[nodiscard]] DeviceFacts facts() const override { return kind_.facts; }
  void unplug() override { command("unplug"); }
  void plug() override { command("plug"); }

  std::vector<Output> outputs() override {
    std::vector<Output> seen;
    std::ifstream file(record());
    std::string row;
    std::getline(file, row);  // the names of the columns
    while (std::getline(file, row)) {
      if (file.eof()) break;  // not whole yet
      std::istringstream fields(row);
      Output output{};
      std::uint32_t channel = 0;
      char comma = 0;
      fields >> output.time_ns >> comma >> channel >> comma >> output.value;
      output.servo = servo_of(channel);
      seen.push_back(output);
    }
    return seen;
  }
  std::vector<double> now() override {
    std::vector<double> values(arm_.dof + 1, std::numeric_limits<double>::quiet_NaN());
    emulator_->send("pulses");
    const auto line = emulator_->wait_line("pulses", within(10));
    if (!line) return values;
    std::istringstream words(line->substr(6));
    for (std::string word; words >> word;) {
      const std::size_t equal = word.find('=');
      values[servo_of(static_cast<std::uint32_t>(std::stoul(word.substr(0, equal))))] =
          std::stod(word.substr(equal + 1));
    }
    return values;
  }

 private:
  [[nodiscard]] std::string line() const { return directory_ + "/tty"; }
  [[nodiscard]] std::string record() const { return directory_ + "/pulses.csv"; }
  void command(const std::string& text) {
    emulator_->send(text);
    if (!emulator_->wait_line("ok", within(10))) throw std::runtime_error(text + ": " + emulator_->errors());
  }
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
  const std::string directory_;
  std::unique_ptr<Process> emulator_;
};

/// Who takes the servos one by one may begin the next frame to them when it has taken some.
constexpr double kServoFrame_s = 0.020;

DeviceFacts serial_facts(double unit_us, double period_s, double read_unit_us, std::string at_end,
                         double skew_s = 0.0) {
  DeviceFacts facts;
  facts.skew_s = skew_s;
  facts.unit = unit_us;
  facts.period_s = period_s;
  facts.approach_speed = 400.0;  // an SSC-32 takes 2 s for what are at most 800 us here
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

}  // namespace corbot::test
