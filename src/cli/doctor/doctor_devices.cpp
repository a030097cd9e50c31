// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/doctor/device_findings.h"
#include "rt/backends/pwm/pca9685.h"

namespace corbot::cli {

namespace {

constexpr std::uint8_t kMode1 = 0x00;
constexpr std::uint8_t kSleep = 0x10;
constexpr std::uint8_t kPreScale = 0xFE;
constexpr int kLeastPrescale = 3;

Finding pwm(const PwmSysfsOptions& options) {
  const std::string what = "backend pwm_sysfs: " + options.chip;
  const std::string use = options.chip + "/export";
  if (::access(use.c_str(), W_OK) == 0) return device_ok(what + " can be used");
  if (errno == EACCES) {
    return device_failure(what + ": Permission denied", "install packaging/udev and join the group gpio");
  }
  return device_failure(
      what + ": is not a PWM controller",
      "load its driver (on a Raspberry Pi: dtoverlay=pwm-2chan), or correct backend.pwm_sysfs.chip; "
      "ls /sys/class/pwm lists them");
}

}  // namespace

Finding not_opened(const std::string& text, int error, const std::string& group,
                   const std::string& if_absent) {
  return device_failure(
      fmt::format("{}: {}", text, std::strerror(error)),
      error == EACCES
          ? fmt::format("sudo adduser $USER {}, then log in again; or install packaging/udev", group)
          : if_absent);
}

Finding device_file(const std::string& what, const std::string& path, const std::string& group,
                    const std::string& if_absent) {
  const std::string text = fmt::format("{}: {}", what, path);
  struct stat status {};
  if (::access(path.c_str(), R_OK | W_OK) != 0 || ::stat(path.c_str(), &status) != 0)
    return not_opened(text, errno, group, if_absent);
  if (!S_ISCHR(status.st_mode)) return device_failure(text + " is not a device", if_absent);
  return device_ok(text + " can be opened");
}

void examine_pca9685(const Pca9685Options& options, const DeviceAccess& access, Findings& findings) {
  findings.push_back(
      device_file("backend pca9685", options.bus, "i2c",
                  "modprobe i2c-dev, switch the bus on (on a Raspberry Pi: dtparam=i2c_arm=on), or "
                  "correct backend.pca9685.bus"));
  if (findings.back().level != Level::kOk) return;
  const auto bus = access.i2c(options.bus, options.address);
  try {
    bus->open();
    std::uint8_t mode = 0;
    std::uint8_t prescale = 0;
    bus->read(kMode1, {&mode, 1});
    bus->read(kPreScale, {&prescale, 1});
    const std::string registers = fmt::format("{}: MODE1 {:02X}h, PRE_SCALE {}", bus->name(), mode, prescale);
    if (prescale < kLeastPrescale) {
      findings.push_back(
          device_failure(registers + ": not a PCA9685, whose prescaler is never below 3",
                         "correct backend.pca9685.address; 'i2cdetect -y N' shows what is there"));
      return;
    }
    const double frame_us = rt::Pca9685::count_us(options.oscillator_hz, prescale) * rt::Pca9685::kCounts;
    findings.push_back(
        device_ok(fmt::format("{}, {}, {:.1f} frames a second", registers,
                              (mode & kSleep) != 0 ? "asleep: no pulses" : "awake", 1e6 / frame_us)));
  } catch (const rt::DeviceError& error) {
    findings.push_back(device_failure(fmt::format("backend pca9685: {}", error.what()),
                                      "check its supply (VCC), SDA and SCL, and backend.pca9685.address; "
                                      "'i2cdetect -y N' shows what is there"));
  }
}

Findings examine_devices(const Profile& profile, const DeviceAccess& access) {
  Findings findings;
  const std::string& kind = profile.backend.kind;
  if (kind == "loopback") {
    findings.push_back(device_ok("backend loopback (the simulator): needs none"));
  } else if (kind == "pca9685") {
    examine_pca9685(profile.backend.pca9685, access, findings);
  } else if (kind == "pwm_sysfs") {
    findings.push_back(pwm(profile.backend.pwm_sysfs));
  } else if (kind == "socketcan") {
    examine_can(profile, findings);
  } else if (kind != "gpiod") {
    examine_serial(profile, access, findings);
  }
  examine_lines(profile, access, false, findings);
  return findings;
}

}  // namespace corbot::cli
