// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::faults_test {
namespace {

using testing::HasSubstr;

std::string lynx5() {
  std::ifstream stream{std::string{CORBOT_PROFILES} + "/lynx5.toml"};
  return {std::istreambuf_iterator<char>{stream}, {}};
}

/// One edit of a valid profile and the fault that it must give. `line_of` is text on the line of the fault,
/// after the edit.
struct Case {
  std::string name;
  std::string from;
  std::string to;
  std::string line_of;
  std::string key;
  std::string value;
  std::string allowed;
};

void PrintTo(const Case& test, std::ostream* out) { *out << test.name; }

std::uint32_t line_with(const std::string& text, const std::string& piece) {
  const auto at = text.find(piece);
  EXPECT_NE(at, std::string::npos) << piece;
  return static_cast<std::uint32_t>(
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

std::vector<ConfigFault> faults_of(const std::string& text) {
  try {
    (void)parse_profile(text, "arm.toml");
  } catch (const ConfigError& error) {
    return error.faults();
  }
  return {};
}

class Refused : public testing::TestWithParam<Case> {};

TEST_P(Refused, WithFileLineKeyValueAndWhatIsAllowed) {
  const Case& test = GetParam();
  std::string text = lynx5();
  const auto at = text.find(test.from);
  ASSERT_NE(at, std::string::npos) << "the profile no longer holds " << test.from;
  text.replace(at, test.from.size(), test.to);
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u) << [&faults] {
    std::string all;
    for (const auto& fault : faults) all += fault.text() + "\n";
    return all;
  }();
  EXPECT_EQ(faults[0].file, "arm.toml");
  EXPECT_EQ(faults[0].line, line_with(text, test.line_of));
  EXPECT_EQ(faults[0].key, test.key);
  EXPECT_EQ(faults[0].value, test.value);
  EXPECT_THAT(faults[0].allowed, HasSubstr(test.allowed));
  const std::string message = faults[0].text();
  EXPECT_THAT(message, HasSubstr("arm.toml:" + std::to_string(faults[0].line) + ": " + test.key));
  if (!test.value.empty()) {
    EXPECT_THAT(message, HasSubstr(test.key + " = " + test.value + ": "));
  }
}

const std::vector<Case> kCases{
    // [robot]
    {"NameEmpty", "\"lynx5\"", "\"\"", "name = \"\"", "robot.name", "\"\"", "1 to 32 ASCII letters"},
    {"NameWithSlash", "\"lynx5\"", "\"a/b\"", "\"a/b\"", "robot.name", "\"a/b\"", "1 to 32 ASCII letters"},
    {"NameTooLong", "\"lynx5\"", "\"" + std::string(33, 'x') + "\"", "xxx", "robot.name",
     "\"" + std::string(33, 'x') + "\"", "1 to 32"},
    {"NameNotText", "\"lynx5\"", "5", "name = 5", "robot.name", "5", "must be a string"},
    {"NameMissing", "name = \"lynx5\"", "", "[robot]", "robot.name", "", "is missing"},
    {"KindScara", "\"anthropomorphic\"", "\"scara\"", "\"scara\"", "robot.kind", "\"scara\"",
     "anthropomorphic"},
    {"OrientationErrorNegative", "name = \"lynx5\"", "orientation_error_deg = -1\nname = \"lynx5\"",
     "orientation_error_deg", "robot.orientation_error_deg", "-1", "from 0 to 180 degrees"},
    {"OrientationErrorAboveHalfATurn", "name = \"lynx5\"", "orientation_error_deg = 181\nname = \"lynx5\"",
     "orientation_error_deg", "robot.orientation_error_deg", "181", "from 0 to 180 degrees"},
    {"OrientationErrorNan", "name = \"lynx5\"", "orientation_error_deg = nan\nname = \"lynx5\"",
     "orientation_error_deg", "robot.orientation_error_deg", "nan", "must be a number"},
    // [geometry]
    {"LengthNegative", "l1_m = 0.120", "l1_m = -0.12", "l1_m", "geometry.l1_m", "-0.12",
     "above 0 and at most 5 m"},
    {"LengthZero", "l3_m = 0.100", "l3_m = 0", "l3_m", "geometry.l3_m", "0", "above 0"},
    {"LengthInMillimetres", "l2_m = 0.120", "l2_m = 120", "l2_m", "geometry.l2_m", "120", "at most 5 m"},
    {"LengthNan", "l1_m = 0.120", "l1_m = nan", "l1_m", "geometry.l1_m", "nan", "must be a number"},
    {"LengthInfinite", "l1_m = 0.120", "l1_m = inf", "l1_m", "geometry.l1_m", "inf", "must be a number"},
    {"LengthHuge", "l1_m = 0.120", "l1_m = 1e308", "l1_m", "geometry.l1_m", "1e+308", "at most 5 m"},
    {"LengthText", "l1_m = 0.120", "l1_m = \"0.12\"", "l1_m", "geometry.l1_m", "\"0.12\"",
     "must be a number"},
    {"LengthBoolean", "l1_m = 0.120", "l1_m = true", "l1_m", "geometry.l1_m", "true", "must be a number"},
    {"LengthDate", "l1_m = 0.120", "l1_m = 2020-01-02", "l1_m", "geometry.l1_m", "2020-01-02",
     "must be a number"},
    {"OffsetShort", "[0, 10, 0, -45]", "[0, 10, 0]", "offset_deg", "geometry.offset_deg", "[0, 10, 0]",
     "4 numbers in brackets"},
    {"OffsetNan", "[0, 10, 0, -45]", "[0, 10, nan, -45]", "offset_deg", "geometry.offset_deg[2]", "nan",
     "from -180 to 180"},
    {"UnknownKey", "l3_m = 0.100", "l3_m = 0.100\nl4_m = 0.1", "l4_m", "geometry.l4_m", "0.1", "is unknown"},
    {"Misspelt", "queue = 16", "queu = 16", "queu ", "servant.queu", "16", "did you mean queue?"},
    {"UnitForgotten", "turn_jerk_deg_s3 = 4000", "turn_jerk_deg_s3 = 4000\nturn_jerk = 1", "turn_jerk = 1",
     "path.turn_jerk", "1", "did you mean turn_jerk_deg_s3?"},
    {"UnknownTable", "[loop]", "[lop]\nx = 1\n[loop]", "[lop]", "lop", "a table", "did you mean loop?"},
    // [[joint]]
    {"RangeReversed", "[-90, 90]", "[90, -90]", "[90, -90]", "joint[0].range_deg", "[90, -90]",
     "LOWER below UPPER"},
    {"RangeEmpty", "[-90, 90]", "[0, 0]", "[0, 0]", "joint[0].range_deg", "[0, 0]", "LOWER below UPPER"},
    {"RangeOneNumber", "[-90, 90]", "[90]", "[90]", "joint[0].range_deg", "[90]", "2 numbers in brackets"},
    {"RangeNotArray", "[-90, 90]", "90", "range_deg = 90", "joint[0].range_deg", "90",
     "2 numbers in brackets"},
    {"RangeBeyondTurn", "[-90, 90]", "[-190, 90]", "[-190", "joint[0].range_deg[0]", "-190",
     "from -180 to 180"},
    {"RangeWithoutReady", "[-90, 90]", "[10, 90]", "[10, 90]", "joint[0].range_deg", "[10, 90]",
     "must contain 0"},
    {"RangeBeyondPulse", "[-90, 90]", "[-90, 101]", "[-90, 101]", "joint[0].range_deg", "[-90, 101]",
     "needs a pulse of 2510 us at 101 degrees, but pulse_range_us allows 500 to 2500"},
    {"SpeedZero", "speed_deg_s = 180", "speed_deg_s = 0", "speed_deg_s = 0", "joint[0].speed_deg_s", "0",
     "above 0"},
    {"AccelerationNegative", "acceleration_deg_s2 = 800", "acceleration_deg_s2 = -1", "= -1",
     "joint[1].acceleration_deg_s2", "-1", "above 0"},
    {"JerkMissing", "jerk_deg_s3 = 8000\nservo = { channel = 3", "servo = { channel = 3",
     "[[joint]]\nname = \"wrist\"", "joint[3].jerk_deg_s3", "", "is missing"},
    {"JointNameTwice", "name = \"elbow\"", "name = \"base\"", "name = \"base\"  # 1500", "joint[2].name",
     "\"base\"", "earlier joint"},
    {"ChannelTwice", "channel = 1,", "channel = 0,", "zero_us = 1000", "joint[1].servo.channel", "0",
     "is used by joint[0].servo.channel"},
    {"ChannelOfGripper", "channel = 4", "channel = 2", "channel = 2\nclosed", "gripper.channel", "2",
     "is used by joint[2].servo.channel"},
    {"ChannelTooHigh", "channel = 3,", "channel = 32,", "channel = 32", "joint[3].servo.channel", "32",
     "0 to 31"},
    {"ChannelFraction", "channel = 3,", "channel = 3.5,", "channel = 3.5", "joint[3].servo.channel", "3.5",
     "whole number"},
    {"DirectionZero", "direction = -1", "direction = 0", "direction = 0", "joint[2].servo.direction", "0",
     "1 or -1"},
    {"DirectionTwo", "direction = -1", "direction = 2", "direction = 2", "joint[2].servo.direction", "2",
     "1 or -1"},
    {"ScaleZero", "us_per_degree = 10, direction = -1", "us_per_degree = 0, direction = -1",
     "us_per_degree = 0", "joint[2].servo.us_per_degree", "0", "above 0"},
    {"PulseRangeTooWide", "[500, 2500] }", "[400, 2500] }", "[400", "joint[0].servo.pulse_range_us[0]", "400",
     "from 500 to 2500 us"},
    {"ServoNotTable",
     "servo = { channel = 3, zero_us = 1050, us_per_degree = 10, direction = 1, pulse_range_us = [500, 2500] "
     "}",
     "servo = 3", "servo = 3", "joint[3].servo", "3", "must be a table"},
    // [gripper], [path]
    {"GripperDoesNotMove", "open_us = 1100", "open_us = 1900", "open_us", "gripper.open_us", "1900",
     "must differ"},
    {"GripperPulse", "open_us = 1100", "open_us = 2600", "open_us", "gripper.open_us", "2600",
     "from 500 to 2500 us"},
    {"GripperTravel", "travel_s = 0.5", "travel_s = 0", "travel_s", "gripper.travel_s", "0",
     "from 0.01 to 60 s"},
    {"PathSpeed", "speed_m_s = 0.25", "speed_m_s = -inf", "speed_m_s", "path.speed_m_s", "-inf", "above 0"},
    // [loop], [servant], [backend]
    {"PeriodShort", "period_us = 1000", "period_us = 249", "period_us", "loop.period_us", "249",
     "250 to 20000 us"},
    {"PeriodLong", "period_us = 1000", "period_us = 20001", "period_us", "loop.period_us", "20001",
     "250 to 20000"},
    {"PeriodOverflow", "period_us = 1000", "period_us = 9223372036854775807", "period_us", "loop.period_us",
     "9223372036854775807", "250 to 20000"},
    {"Priority", "priority = 80", "priority = 99", "priority", "loop.priority", "99", "1 to 98"},
    {"Cpu", "cpu = -1", "cpu = -2", "cpu", "loop.cpu", "-2", "-1 to 1023"},
    {"GapFaultShort", "gap_fault_ms = 100", "gap_fault_ms = 9", "gap_fault_ms", "loop.gap_fault_ms", "9",
     "10 to 10000 ms"},
    {"GapFaultLong", "gap_fault_ms = 100", "gap_fault_ms = 10001", "gap_fault_ms", "loop.gap_fault_ms",
     "10001", "10 to 10000 ms"},
    {"GapFaultFewPeriods",
     "period_us = 1000  # 250 .. 20000\npriority = 80     # SCHED_FIFO, 1 .. 98\n"
     "cpu = -1          # -1: any\ngap_fault_ms = 100",
     "period_us = 20000\ngap_fault_ms = 99", "gap_fault_ms", "loop.gap_fault_ms", "99",
     "at least 5 periods, 100 ms"},
    {"FrozenShort", "frozen_ms = 100", "frozen_ms = 59", "frozen_ms", "loop.frozen_ms", "59",
     "60 to 10000 ms"},
    {"OrphanShort", "orphan_s = 2.0", "orphan_s = 0.4", "orphan_s", "loop.orphan_s", "0.4", "0.5 to 60 s"},
    {"Port", "port = 12810", "port = 65536", "port", "servant.port", "65536", "1 to 65535"},
    {"Host", "\"127.0.0.1\"", "\"local host\"", "local host", "servant.host", "\"local host\"", "host name"},
    {"Queue", "queue = 16", "queue = 0", "queue", "servant.queue", "0", "1 to 32"},
    {"RespondShort", "respond_s = 3.0", "respond_s = 0.4", "respond_s", "supervisor.respond_s", "0.4",
     "0.5 to 60 s"},
    {"Attempts", "attempts = 10", "attempts = -1", "attempts", "supervisor.attempts", "-1", "0 to 1000"},
    {"BackendKind", "\"loopback\"", "\"ssc64\"", "\"ssc64\"", "backend.kind", "\"ssc64\"",
     "supported: \"loopback\""},
    {"SerialTableMissing", "kind = \"loopback\"", "kind = \"ssc32\"", "[backend]", "backend.ssc32", "",
     "is missing"},
    {"SerialPort", "kind = \"loopback\"", "kind = \"ssc32\"\nssc32 = { port = \"COM3\" }", "COM3",
     "backend.ssc32.port", "\"COM3\"", "such as /dev/ttyUSB0"},
    {"SerialSocketLong", "kind = \"loopback\"",
     "kind = \"ssc32\"\nssc32 = { port = \"unix:/" + std::string(107, 's') + "\" }", "unix:/ss",
     "backend.ssc32.port", "\"unix:/" + std::string(53, 's') + "...", "at most 107 bytes"},
    {"Baud", "kind = \"loopback\"", "kind = \"ssc32\"\nssc32 = { port = \"/dev/x\", baud = 4800 }", "4800",
     "backend.ssc32.baud", "4800", "2400, 9600, 38400, 115200"},
    {"AtEnd", "kind = \"loopback\"", "kind = \"maestro\"\nmaestro = { port = \"/dev/x\", at_end = \"drop\" }",
     "drop", "backend.maestro.at_end", "\"drop\"", "\"hold\" or \"relax\""},
    {"DeviceNumber", "kind = \"loopback\"",
     "kind = \"maestro\"\nmaestro = { port = \"/dev/x\", device_number = 128 }", "device_number = 128",
     "backend.maestro.device_number", "128", "-1 to 127"},
    {"MaestroBaud", "kind = \"loopback\"",
     "kind = \"maestro\"\nmaestro = { port = \"/dev/x\", baud = 230400 }", "baud = 230400",
     "backend.maestro.baud", "230400", "38400, 57600, 115200"},
    {"MiniSscRange", "kind = \"loopback\"",
     "kind = \"minissc\"\nminissc = { port = \"/dev/x\", pulse_range_us = [400, 2500] }",
     "pulse_range_us = [400", "backend.minissc.pulse_range_us[0]", "400", "500 to 2500"},
    {"MiniSscNeverAnswers", "kind = \"loopback\"",
     "kind = \"minissc\"\nminissc = { port = \"/dev/x\", readback = true }", "readback = true",
     "backend.minissc.readback", "true", "unknown"},
    {"UnusedKindIsChecked", "kind = \"loopback\"",
     "kind = \"loopback\"\nssc32 = { port = \"/dev/x\", baud = 1 }", "baud = 1", "backend.ssc32.baud", "1",
     "must be one of"},
    {"StopInput", "kind = \"loopback\"",
     "kind = \"ssc32\"\nssc32 = { port = \"/dev/x\", stop_input = \"G\" }", "stop_input",
     "backend.ssc32.stop_input", "\"G\"", "\"A\" to \"D\"; on an SSC-32U to \"F\""},
    {"StopActive", "kind = \"loopback\"",
     "kind = \"ssc32\"\nssc32 = { port = \"/dev/x\", stop_input = \"A\", stop_active = \"up\" }",
     "stop_active", "backend.ssc32.stop_active", "\"up\"", "\"high\" or \"low\""},
    {"PwmTableMissing", "kind = \"loopback\"", "kind = \"pwm_sysfs\"", "[backend]", "backend.pwm_sysfs", "",
     "is missing"},
    {"PwmChip", "kind = \"loopback\"", "kind = \"pwm_sysfs\"\npwm_sysfs = { chip = \"pwmchip0\" }",
     "\"pwmchip0\"", "backend.pwm_sysfs.chip", "\"pwmchip0\"", "such as /sys/class/pwm/pwmchip0"},
    {"PwmRate", "kind = \"loopback\"", "kind = \"pwm_sysfs\"\npwm_sysfs = { chip = \"/x\", frame_hz = 1000 }",
     "frame_hz = 1000", "backend.pwm_sysfs.frame_hz", "1000", "from 40 to 200 Hz"},
    {"I2cBus", "kind = \"loopback\"", "kind = \"pca9685\"\npca9685 = { bus = \"1\" }",
     "bus = ", "backend.pca9685.bus", "\"1\"", "such as /dev/i2c-1"},
    {"I2cAddress", "kind = \"loopback\"",
     "kind = \"pca9685\"\npca9685 = { bus = \"/dev/i2c-1\", address = 0x80 }", "address",
     "backend.pca9685.address", "128", "from 8 to 119"},
    {"Oscillator", "kind = \"loopback\"",
     "kind = \"pca9685\"\npca9685 = { bus = \"/dev/i2c-1\", oscillator_hz = 25 }", "oscillator_hz",
     "backend.pca9685.oscillator_hz", "25", "Hz"},
    {"Pca9685AtEnd", "kind = \"loopback\"",
     "kind = \"pca9685\"\npca9685 = { bus = \"/dev/i2c-1\", at_end = \"off\" }", "at_end",
     "backend.pca9685.at_end", "\"off\"", "\"hold\" or \"relax\""},
    {"ChannelsOfGpiod", "kind = \"loopback\"",
     "kind = \"gpiod\"\ngpiod = { chip = \"/dev/gpiochip0\", lines = [\"A\", \"B\", \"C\", \"D\"] }",
     "kind = \"gpiod\"", "backend.kind", "\"gpiod\"",
     "has channels 0 to 3, one for each of backend.gpiod.lines, but gripper.channel is 4"},
    {"LinesTwice", "kind = \"loopback\"",
     "kind = \"gpiod\"\ngpiod = { chip = \"/x\", lines = [\"1\", \"2\", \"3\", \"4\", \"2\"] }", "lines = [",
     "backend.gpiod.lines", "[\"1\", \"2\", \"3\", \"4\", \"2\"]", "each different and not empty"},
    {"LinesNotText", "kind = \"loopback\"", "kind = \"gpiod\"\ngpiod = { chip = \"/x\", lines = [1, 2] }",
     "lines = [", "backend.gpiod.lines", "[1, 2]", "strings in brackets"},
    {"LinesTooManyToStagger", "kind = \"loopback\"",
     "kind = \"gpiod\"\n"
     "gpiod = { chip = \"/x\", lines = [\"1\", \"2\", \"3\", \"4\", \"5\"], frame_hz = 100 }",
     "lines = [", "backend.gpiod.lines", "[\"1\", \"2\", \"3\", \"4\", \"5\"]", "pulses = \"together\""},
    {"PulseOrder", "kind = \"loopback\"",
     "kind = \"gpiod\"\n"
     "gpiod = { chip = \"/x\", lines = [\"1\", \"2\", \"3\", \"4\", \"5\"], pulses = \"x\" }",
     "pulses", "backend.gpiod.pulses", "\"x\"", "\"staggered\" or \"together\""},
    {"AwakeTooLong", "kind = \"loopback\"",
     "kind = \"gpiod\"\n"
     "gpiod = { chip = \"/x\", lines = [\"1\", \"2\", \"3\", \"4\", \"5\"], awake_us = 1000 }",
     "awake_us", "backend.gpiod.awake_us", "1000", "from 0 to 200"},
    {"StopRampTooShort", "ramp_s = 1.0", "ramp_s = 0.9", "ramp_s = 0.9", "stop.ramp_s", "0.9",
     "from 0.99 s, the duration of the longest stop by the limits of this profile, to 10 s"},
    {"StopChip", "[backend]", "[emergency_stop]\nchip = \"gpiochip0\"\nline = \"ESTOP\"\n[backend]",
     "chip = ", "emergency_stop.chip", "\"gpiochip0\"", "such as /dev/gpiochip0"},
    {"StopLineMissing", "[backend]", "[emergency_stop]\nchip = \"/dev/gpiochip0\"\n[backend]",
     "[emergency_stop]", "emergency_stop.line", "", "is missing"},
    {"StopBias", "[backend]",
     "[emergency_stop]\nchip = \"/dev/gpiochip0\"\nline = \"17\"\nbias = \"up\"\n[backend]", "bias",
     "emergency_stop.bias", "\"up\"", "\"pull-up\""},
    {"PowerActive", "[backend]",
     "[power_enable]\nchip = \"/dev/gpiochip0\"\nline = \"17\"\nactive = 1\n[backend]", "active",
     "power_enable.active", "1", "must be a string"},
    {"PowerMisspelt", "[backend]", "[power_enabel]\nchip = \"/x\"\n[backend]", "[power_enabel]",
     "power_enabel", "a table", "did you mean power_enable?"},
    {"WatchdogChip", "[backend]", "[watchdog]\nchip = \"gpiochip0\"\nline = \"W\"\n[backend]",
     "chip = ", "watchdog.chip", "\"gpiochip0\"", "such as /dev/gpiochip0"},
    {"WatchdogLineMissing", "[backend]", "[watchdog]\nchip = \"/dev/gpiochip0\"\n[backend]", "[watchdog]",
     "watchdog.line", "", "is missing"},
    {"WatchdogPeriod", "[backend]",
     "[watchdog]\nchip = \"/dev/gpiochip0\"\nline = \"20\"\nperiod_ms = 1\n[backend]", "period_ms",
     "watchdog.period_ms", "1", "from 2 to 1000 ms"},
    {"WatchdogLevel", "[backend]",
     "[watchdog]\nchip = \"/dev/gpiochip0\"\nline = \"20\"\nactive = true\n[backend]", "active",
     "watchdog.active", "true", "must be a string"},
    {"WatchdogOnThePowersLine", "[backend]",
     "[power_enable]\nchip = \"/dev/gpiochip0\"\nline = \"20\"\n[watchdog]\nchip = \"/dev/gpiochip0\"\n"
     "line =  \"20\"\n[backend]",
     "line =  ", "watchdog.line", "\"20\"", "is the line of power_enable"},
    {"FrameRate", "frame_hz = 50", "frame_hz = 0", "frame_hz", "backend.loopback.frame_hz", "0",
     "1 to 1000 Hz"},
    {"Readback", "readback = false", "readback = 0", "readback", "backend.loopback.readback", "0",
     "true or false"},
};

INSTANTIATE_TEST_SUITE_P(Profile, Refused, testing::ValuesIn(kCases),
                         [](const auto& parameter) { return parameter.param.name; });

TEST(Refusal, APowerThatStaysIsNoCategory0) {
  std::string text = lynx5();
  for (const auto& [from, to] :
       {std::pair{"category = 1", "category = 0"},
        {"[backend]",
         "[power_enable]\nchip = \"/dev/gpiochip0\"\nline = \"17\"\noff_at_stop = false\n[backend]"}}) {
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), std::string{from}.size(), to);
  }
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "power_enable.off_at_stop");
  EXPECT_EQ(faults[0].value, "false");
  EXPECT_EQ(
      faults[0].allowed,
      "contradicts stop.category = 0, which switches the power off at once: set it to true, or category = 1");
}

TEST(Refusal, AWatchdogIsNotFasterThanTheLoop) {
  std::string text = lynx5();
  for (const auto& [from, to] :
       {std::pair{"period_us = 1000", "period_us = 20000"},
        {"[backend]", "[watchdog]\nchip = \"/dev/gpiochip0\"\nline = \"20\"\nperiod_ms = 19\n[backend]"}}) {
    text.replace(text.find(from), std::string{from}.size(), to);
  }
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "watchdog.period_ms");
  EXPECT_THAT(faults[0].allowed, HasSubstr("at least the period of the loop, 20 ms"));
}

TEST(Refusal, NamesAllFaultsAtOnceInTheOrderOfTheFile) {
  std::string text = lynx5();
  for (const auto& [from, to] :
       {std::pair{"l1_m = 0.120", "l1_m = nan"}, {"cpu = -1", "cpu = 1.5"}, {"name = \"base\"", ""}}) {
    text.replace(text.find(from), std::string{from}.size(), to);
  }
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_EQ(faults[0].key, "geometry.l1_m");
  EXPECT_EQ(faults[1].key, "joint[0].name");
  EXPECT_EQ(faults[2].key, "loop.cpu");
  EXPECT_THAT(ConfigError{faults}.what(), HasSubstr(faults[0].text() + "\n" + faults[1].text() + "\n"));
}

TEST(Refusal, OfAMisspeltBackendAsksForNoServos) {
  std::string text = lynx5();
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("kind = \"loopback\"", "kind = \"loopbak\"");
  const std::size_t servo = text.find("servo = {");
  text.erase(servo, text.find('\n', servo) - servo);
  const std::vector<ConfigFault> faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "backend.kind");
  EXPECT_THAT(faults[0].allowed, testing::EndsWith("; did you mean \"loopback\"?"));
}

TEST(Refusal, OfAChannelThatAMaestroDoesNotHave) {
  std::string text = lynx5();
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("kind = \"loopback\"", "kind = \"maestro\"\nmaestro = { port = \"/dev/x\" }");
  replace("channel = 3", "channel = 23");
  EXPECT_TRUE(faults_of(text).empty());
  replace("channel = 23", "channel = 24");
  const std::vector<ConfigFault> faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "backend.kind");
  EXPECT_THAT(faults[0].allowed, HasSubstr("has channels 0 to 23, but joint[3].servo.channel is 24"));
}

TEST(Refusal, OfAnEmptyProfileNamesEveryRequiredTable) {
  std::vector<std::string> keys;
  for (const auto& fault : faults_of("")) keys.push_back(fault.key);
  EXPECT_THAT(keys,
              testing::UnorderedElementsAre("robot", "geometry", "joint", "gripper", "path", "backend"));
}

TEST(Refusal, OfAWrongNumberOfJoints) {
  std::string text = lynx5();
  const auto wrist = text.find("[[joint]]\nname = \"wrist\"");
  text.erase(wrist, text.find("[gripper]") - wrist);
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "joint");
  EXPECT_THAT(faults[0].allowed, HasSubstr("3 joints"));
}

TEST(Refusal, OfWhatIsNotTomlNamesTheLine) {
  for (const std::string bad :
       {"speed = = 1", "[robot]", "x = 1\nx = 2", "a = \"\xff\"", "a = [", "x = 1e"}) {
    const auto faults = faults_of(lynx5() + bad);
    ASSERT_EQ(faults.size(), 1u) << bad;
    EXPECT_THAT(faults[0].allowed, HasSubstr("not TOML: ")) << bad;
    EXPECT_GE(faults[0].line, line_with(lynx5(), "readback")) << bad;
  }
}

TEST(Refusal, OfFilesThatCannotBeProfiles) {
  EXPECT_THROW(
      try { (void)load_profile("/nowhere/arm.toml"); } catch (const ConfigError& error) {
        EXPECT_STREQ(error.what(), "/nowhere/arm.toml: no such file");
        throw;
      },
      ConfigError);
  EXPECT_THROW((void)load_profile(CORBOT_PROFILES), ConfigError);
  const auto of_cell = faults_of("[cell]\nname = \"cell\"\n");
  ASSERT_EQ(of_cell.size(), 1u);
  EXPECT_EQ(of_cell[0].allowed, "is a cell file, not a robot's profile: 'corbot cell run' takes it");
  EXPECT_THROW((void)load_profile("/dev/zero"), ConfigError);
  EXPECT_EQ(faults_of(std::string(kMaxProfileBytes + 1, '#')).size(), 1u);
  EXPECT_EQ(faults_of(std::string(10000, '[')).size(), 1u);
}

TEST(Refusal, ANameOfAShippedProfileIsAnsweredWithItsPath) {
  const auto refusal = [](const char* file) -> std::string {
    try {
      (void)load_profile(file);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::path(CORBOT_PROFILES).parent_path());
  EXPECT_EQ(refusal("lynx5"), "lynx5: no such file; did you mean 'profiles/lynx5.toml'?");
  EXPECT_EQ(refusal("lynx5.toml"), "lynx5.toml: no such file; did you mean 'profiles/lynx5.toml'?");
  EXPECT_EQ(refusal("lynx"), "lynx: no such file");
  EXPECT_EQ(refusal("profiles/lynx6.toml"),
            "profiles/lynx6.toml: no such file; did you mean 'profiles/lynx5.toml'?");
  EXPECT_EQ(refusal("profiles/lynx5-can"),
            "profiles/lynx5-can: no such file; did you mean 'profiles/lynx5-can.toml'?");
  EXPECT_EQ(refusal("profiles/robot.toml"), "profiles/robot.toml: no such file");
  EXPECT_EQ(refusal("elsewhere/lynx5"), "elsewhere/lynx5: no such file");
  std::filesystem::current_path(before);
}

}  // namespace
}  // namespace corbot::faults_test
