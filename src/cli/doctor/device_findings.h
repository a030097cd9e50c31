// SPDX-License-Identifier: Apache-2.0
// Shared functions of the device examinations.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/doctor/finding.h"
#include "config/profile.h"
#include "rt/backends/bus/device_error.h"
#include "rt/backends/gpio/gpio_lines.h"
#include "rt/backends/pwm/i2c_bus.h"
#include "rt/backends/serial/serial_port.h"

namespace corbot::rt {
struct CanLink;
}

namespace corbot::cli {

/// Access to devices; tests provide their own.
struct DeviceAccess {
  std::function<std::unique_ptr<rt::SerialLine>()> serial{[] { return std::make_unique<rt::SerialPort>(); }};
  std::function<std::unique_ptr<rt::I2cBus>(const std::string& path, int address)> i2c{
      [](const std::string& path, int address) { return std::make_unique<rt::I2cDev>(path, address); }};
  std::shared_ptr<rt::GpioChips> gpio{rt::kernel_gpio()};
  std::string sys{"/sys"};
};

using Findings = std::vector<Finding>;

inline Finding device_ok(std::string text) { return {Level::kOk, "devices", std::move(text), ""}; }
inline Finding device_warning(std::string text, std::string fix) {
  return {Level::kWarn, "devices", std::move(text), std::move(fix)};
}
inline Finding device_failure(std::string text, std::string fix) {
  return {Level::kFail, "devices", std::move(text), std::move(fix)};
}
/// Reports a file that cannot be opened. `group` is the group that may open it.
[[nodiscard]] Finding not_opened(const std::string& text, int error, const std::string& group,
                                 const std::string& if_absent);
/// Checks a character device, which must exist and open for reading and writing.
[[nodiscard]] Finding device_file(const std::string& what, const std::string& path, const std::string& group,
                                  const std::string& if_absent);

// Each examination opens the device, queries it and closes it. It sends nothing that moves, energises or
// configures anything.
void examine_serial(const Profile& profile, const DeviceAccess& access, Findings& findings);
void examine_pca9685(const Pca9685Options& options, const DeviceAccess& access, Findings& findings);
void examine_can(const Profile& profile, Findings& findings);
/// Examines an interface that is up: bit rate, state of the bus, restart-ms.
[[nodiscard]] Findings examine_can_link(const rt::CanLink& link, const std::string& name);

/// Examines the lines of pulses, emergency stop, power and watchdog. `is_up`: the robot holds the lines, and
/// none is requested.
void examine_lines(const Profile& profile, const DeviceAccess& access, bool is_up, Findings& findings);

/// Examines all devices in the profile. For a robot that is up use examine_running().
[[nodiscard]] Findings examine_devices(const Profile& profile, const DeviceAccess& access);

/// Queries a robot that is up about its device, which it has open. `robot`: the name under which it is up.
[[nodiscard]] Findings examine_running(const Profile& profile, const std::string& robot,
                                       const DeviceAccess& access);

}  // namespace corbot::cli
