// SPDX-License-Identifier: Apache-2.0
// Tests the queries of `corbot doctor` to a device while the robot is down, with emulated devices. None of
// them moves or energises.
#include <gmock/gmock.h>
#include <linux/can/netlink.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "cli/doctor/device_findings.h"
#include "rt/backends/can/can_link.h"
#include "sim/devices/maestro_device.h"
#include "support/chip_bus.h"
#include "support/emulated_drives.h"
#include "support/emulated_line.h"
#include "support/paths.h"

namespace corbot::cli {

static void PrintTo(const Finding& finding, std::ostream* out) { *out << finding.text; }

namespace {

namespace fs = std::filesystem;
using test::within;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

auto is_ok(const std::string& text) {
  return AllOf(Field(&Finding::level, Level::kOk), Field(&Finding::text, HasSubstr(text)));
}
auto is_warning(const std::string& text) {
  return AllOf(Field(&Finding::level, Level::kWarn), Field(&Finding::text, HasSubstr(text)));
}
auto is_failure(const std::string& text) {
  return AllOf(Field(&Finding::level, Level::kFail), Field(&Finding::text, HasSubstr(text)));
}
std::string all_of(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) text += finding.text + "\n";
  return text;
}
/// Each finding that is not ok has a fix, and no other has one.
void expect_fixes(const Findings& findings) {
  for (const Finding& finding : findings) {
    EXPECT_EQ(finding.fix.empty(), finding.level == Level::kOk) << finding.text;
  }
}

class DoctorDevices : public testing::Test {
 protected:
  DoctorDevices() {
    std::string path = CORBOT_SCRATCH_DIR "/doctor-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    profile_.name = "doctor-of-no-robot";
    profile_.arm.dof = 4;
    profile_.arm.period_ns = 4'000'000;
  }
  ~DoctorDevices() override { fs::remove_all(directory_); }

  /// A serial line as a program sees it: a terminal, behind which nothing answers but `access_.serial`.
  std::string terminal(const std::vector<std::string>& more = {}) {
    const std::string line = (directory_ / "tty").string();
    std::vector<std::string> command{CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", line};
    command.insert(command.end(), more.begin(), more.end());
    emulator_ = std::make_unique<test::Process>(command);
    EXPECT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
    return line;
  }
  [[nodiscard]] Findings examine() const {
    Findings findings = examine_devices(profile_, access_);
    expect_fixes(findings);
    return findings;
  }
  void use_serial(const std::string& kind, const std::string& port, int baud = 115'200) {
    profile_.backend.kind = kind;
    profile_.backend.serial.port = port;
    profile_.backend.serial.baud = baud;
  }
  void use_drives(const std::string& bus, int nodes) {
    profile_.backend.kind = "socketcan";
    profile_.backend.socketcan.interface = bus;
    for (int node = 1; node <= nodes; ++node) {
      CanDrive drive;
      drive.node = node;
      profile_.backend.socketcan.drives.push_back(drive);
    }
  }

  fs::path directory_;
  Profile profile_;
  DeviceAccess access_;
  std::unique_ptr<test::Process> emulator_;
};

TEST_F(DoctorDevices, AnSsc32SaysWhatItIsAndHowItsStopInputIs) {
  use_serial("ssc32", terminal());
  EXPECT_THAT(examine(), Contains(is_ok("SSC-32U (SSC32-V2.50USB)")));
  EXPECT_THAT(all_of(examine()), Not(HasSubstr("stop input"))) << "there is none";
  profile_.backend.serial.stop_input = 'B';
  emulator_->send("input B 1");
  ASSERT_TRUE(emulator_->wait_line("ok input", within(10)));
  EXPECT_THAT(examine(), Contains(is_warning("stop input B is pressed")));
  emulator_->send("input B 0");
  ASSERT_TRUE(emulator_->wait_line("ok input", within(10)));
  EXPECT_THAT(examine(), Contains(is_ok("stop input B is not pressed")));
  emulator_->send("pulses");
  EXPECT_EQ(emulator_->wait_line("pulses", within(10)), "pulses") << "a servo got a pulse";
}

TEST_F(DoctorDevices, ASilentSsc32IsReported) {
  use_serial("ssc32", terminal());
  emulator_->send("silent on");
  ASSERT_TRUE(emulator_->wait_line("ok silent", within(10)));
  EXPECT_THAT(examine(), Contains(is_failure("no answer: is the controller powered")));
}

TEST_F(DoctorDevices, ABaudThatDiffersIsNamed) {
  use_serial("ssc32", terminal({"--baud", "9600"}));
  const Findings findings = examine();
  ASSERT_THAT(findings, Contains(is_failure("an SSC-32 answers at 9600 baud, not at 115200")));
  EXPECT_THAT(findings.back().fix, HasSubstr("backend.ssc32.baud = 9600"));
  emulator_->send("pulses");
  EXPECT_EQ(emulator_->wait_line("pulses", within(10)), "pulses")
      << "what it was sent at other speeds moved it";
}

TEST_F(DoctorDevices, AMaestroAnswersAndItsErrorRegisterIsRead) {
  sim::MaestroDevice device{sim::MaestroOptions{}};
  test::EmulatedWire wire(device, 115'200);
  access_.serial = [&] { return std::make_unique<test::EmulatedLine>(wire); };
  use_serial("maestro", terminal());
  EXPECT_THAT(examine(), Contains(is_ok("a Maestro answers, its error register is empty")));
  const std::vector<std::uint8_t> unknown{0x80, 0x81, 0x82};
  test::EmulatedLine(wire).write(unknown, rt::SerialLine::Clock::now());
  EXPECT_THAT(examine(), Contains(is_warning("its error register had: serial protocol")));
  EXPECT_THAT(examine(), Contains(is_ok("its error register is empty"))) << "reading clears it";
  for (std::size_t i = 0; i < device.channel_count(); ++i) EXPECT_EQ(wire.pulse_us(i), 0.0) << i;
  wire.is_silent = true;
  EXPECT_THAT(examine(), Contains(is_failure("no answer")));
}

TEST_F(DoctorDevices, TheKindOfAMaestroIsToldByUsb) {
  sim::MaestroDevice device{sim::MaestroOptions{}};
  test::EmulatedWire wire(device, 115'200);
  access_.serial = [&] { return std::make_unique<test::EmulatedLine>(wire); };
  use_serial("maestro", terminal());
  // As sysfs has it: class/tty/LINE/device leads to the interface, in the directory of the device.
  access_.sys = (directory_ / "sys").string();
  const fs::path usb = directory_ / "sys/usb/1-1";
  const fs::path line = fs::canonical(profile_.backend.serial.port).filename();
  fs::create_directories(usb / "1-1:1.0");
  fs::create_directories(directory_ / "sys/class/tty" / line);
  fs::create_directory_symlink(usb / "1-1:1.0", directory_ / "sys/class/tty" / line / "device");
  std::ofstream(usb / "idVendor") << "1ffb\n";
  std::ofstream(usb / "idProduct") << "0089\n";
  std::ofstream(usb / "product") << "Pololu Micro Maestro 6-Servo Controller\n";
  std::ofstream(usb / "1-1:1.0/bInterfaceNumber") << "00\n";
  EXPECT_THAT(examine(), AllOf(Contains(is_ok("USB 1ffb:0089 Pololu Micro Maestro 6-Servo Controller")),
                               Contains(is_ok("a Maestro answers: Micro Maestro, 6 channels"))));
  profile_.backend.serial.multi_target = true;
  EXPECT_THAT(examine(), Contains(is_failure("a Micro Maestro has no Set Multiple Targets")));
  std::ofstream(usb / "1-1:1.0/bInterfaceNumber") << "02\n";
  EXPECT_THAT(examine(), Contains(is_failure("is the Maestro's TTL port")));
}

TEST_F(DoctorDevices, AMiniSscCannotAnswer) {
  use_serial("minissc", terminal(), 9600);
  EXPECT_THAT(examine(), Contains(is_ok("minissc never answers: nothing shows whether it is there")));
}

TEST_F(DoctorDevices, ASerialLineIsNoFile) {
  const std::string file = (directory_ / "file").string();
  std::ofstream(file) << "x";
  for (const std::string& path : {file, directory_.string(), std::string("/dev/null")}) {
    use_serial("ssc32", path);
    const Findings findings = examine();
    ASSERT_EQ(findings.size(), 1u) << all_of(findings);
    EXPECT_EQ(findings[0].level, Level::kFail) << findings[0].text;
  }
}

TEST_F(DoctorDevices, ASocketInALinesPlaceIsLookedAtAsTheBackendOpensIt) {
  use_serial("ssc32", "unix:" + (directory_ / "absent").string());
  EXPECT_THAT(examine(), Each(is_failure("No such file")));
  const std::string path = (directory_ / "servos").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(::listen(listener, 8), 0);
  sim::MaestroDevice device{sim::MaestroOptions{}};
  test::EmulatedWire wire(device, 115'200);
  access_.serial = [&] { return std::make_unique<test::EmulatedLine>(wire); };
  use_serial("maestro", "unix:" + path);
  EXPECT_THAT(examine(), Contains(is_ok("a Maestro answers")));
  ::close(listener);
}

TEST_F(DoctorDevices, APca9685IsRead) {
  test::ChipBus::State state;
  access_.i2c = [&](const std::string&, int) { return std::make_unique<test::ChipBus>(state); };
  profile_.backend.kind = "pca9685";
  profile_.backend.pca9685.bus = "/dev/null";  // which can be opened
  EXPECT_THAT(examine(),
              Contains(is_ok("MODE1 11h, PRE_SCALE 30, asleep: no pulses, 196.9 frames a second")));
  EXPECT_TRUE(state.writes.empty()) << "it is only read";
  state.is_there = false;
  EXPECT_THAT(examine(), Contains(is_failure("no device")));
  profile_.backend.pca9685.bus = "/nonexistent/i2c-1";
  const Findings findings = examine();
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0], is_failure("/nonexistent/i2c-1: No such file"));
  EXPECT_THAT(findings[0].fix, HasSubstr("i2c-dev"));
}

TEST_F(DoctorDevices, PwmOfTheKernelIsLookedFor) {
  profile_.backend.kind = "pwm_sysfs";
  profile_.backend.pwm_sysfs.chip = "/nonexistent/pwmchip0";
  EXPECT_THAT(examine(), Contains(is_failure("is not a PWM controller")));
  fs::create_directory(directory_ / "pwmchip0");
  std::ofstream(directory_ / "pwmchip0/export") << "";
  profile_.backend.pwm_sysfs.chip = (directory_ / "pwmchip0").string();
  EXPECT_THAT(examine(), Contains(is_ok("can be used")));
}

TEST_F(DoctorDevices, EachDriveSaysWhatItIs) {
  test::EmulatedDrives drives(CORBOT_BIN_DIR "/corbot-sim", directory_.string(), 3);
  drives.start();
  if (HasFatalFailure()) return;
  use_drives(drives.bus(), 3);
  const Findings first = examine();
  for (const std::string node : {"1", "2", "3"}) {
    EXPECT_THAT(
        first, Contains(is_ok(": node " + node + ": corbot emulated drive, firmware 1.0, vendor 00000000h")));
    EXPECT_THAT(first, Contains(is_ok("node " + node + " is in 'switch on disabled', DC link 48.0 V")));
  }
  profile_.backend.socketcan.drives[0].identity[1] = 0xC0FFEE;
  EXPECT_THAT(examine(), Contains(is_failure("; the profile has product 00C0FFEEh")));
  profile_.backend.socketcan.drives[0].identity = {};
  drives.command("emcy 3210 2");
  drives.command("silent on 3");
  const Findings second = examine();
  EXPECT_THAT(second, Contains(is_failure("node 2 is in 'fault', DC link 48.0 V: EMCY 0x3210")));
  EXPECT_THAT(second, Contains(is_failure("node 3: does not answer")));
  EXPECT_THAT(second, Contains(is_ok("node 1 is in 'switch on disabled'"))) << "it was enabled";
  std::ifstream record(drives.record());
  std::string row;
  std::getline(record, row);
  EXPECT_FALSE(std::getline(record, row)) << "a drive got a target, or moved: " << row;
  EXPECT_EQ(drives.stop(), 0);
}

TEST_F(DoctorDevices, WhatIsNoCanBusIsSaidToBeNone) {
  const auto first = [&](const std::string& bus) {
    profile_.backend.socketcan.drives.clear();
    use_drives(bus, 1);
    return examine().front();
  };
  const std::string file = (directory_ / "file").string();
  std::ofstream(file) << "x";
  EXPECT_THAT(first("unix:" + file), is_failure("is a file, and no CAN bus"));
  EXPECT_THAT(first("unix:" + directory_.string()), is_failure("is a directory, and no CAN bus"));
  EXPECT_THAT(first("unix:/dev/null"), is_failure("is no socket, and no CAN bus"));
  EXPECT_THAT(first("unix:" + file + "-absent"), is_failure("No such file"));
  EXPECT_THAT(first("unix:" + file + "-absent").fix, HasSubstr("corbot-sim cia402"));
  EXPECT_THAT(first(file), is_failure("a path is no interface"));
  EXPECT_THAT(first("no-such-can"), is_failure("no such interface"));
  EXPECT_THAT(first("lo"), is_failure("is not a CAN interface"));
  // Tries a socket that no process listens on, and one of another kind.
  for (const int type : {SOCK_SEQPACKET, SOCK_STREAM}) {
    const std::string path = (directory_ / ("bus" + std::to_string(type))).string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, path.size());
    const int fd = ::socket(AF_UNIX, type | SOCK_CLOEXEC, 0);
    ASSERT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(type == SOCK_STREAM ? ::listen(fd, 1) : 0, 0);
    EXPECT_EQ(first("unix:" + path).level, Level::kFail) << type;
    ::close(fd);
  }
}

TEST(DoctorCanLink, StateAndRestartAreJudged) {
  rt::CanLink link;
  link.is_can = link.is_up = true;
  link.queue = 10;
  EXPECT_THAT(examine_can_link(link, "vcan0"), Each(is_ok("vcan0 is up, has no controller (vcan)")));
  link.bit_rate = 500'000;
  link.restart_ms = 100;
  link.state = rt::CanBusState::kErrorActive;
  EXPECT_THAT(examine_can_link(link, "can0"),
              Each(is_ok("can0 is up, 500000 bit/s, ERROR-ACTIVE, restart-ms 100, txqueuelen 10")));
  link.state = rt::CanBusState::kErrorPassive;
  EXPECT_THAT(examine_can_link(link, "can0"), Each(is_warning("ERROR-PASSIVE")));
  link.state = rt::CanBusState::kBusOff;
  link.restart_ms = 0;
  const Findings findings = examine_can_link(link, "can0");
  EXPECT_THAT(findings, AllOf(Contains(is_failure("BUS-OFF")), Contains(is_warning("restart-ms is 0"))));
  expect_fixes(findings);
}

}  // namespace
}  // namespace corbot::cli
