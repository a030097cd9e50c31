// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/doctor/doctor.h"
#include "client/local_robots.h"
#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::cli {

using client::is_up;

namespace {

constexpr const char* kSubject = "devices";

/// A file that cannot be opened. `group` is the one that may.
Finding not_opened(const std::string& text, int error, const std::string& group,
                   const std::string& if_absent) {
  return {Level::kFail, kSubject, fmt::format("{}: {}", text, std::strerror(error)),
          error == EACCES
              ? fmt::format("sudo adduser $USER {}, then log in again; or install packaging/udev", group)
              : if_absent};
}

/// A character device that must be there and open for reading and writing.
Finding file(const std::string& what, const std::string& path, const std::string& group,
             const std::string& if_absent) {
  const std::string text = fmt::format("{}: {}", what, path);
  struct stat status {};
  if (::access(path.c_str(), R_OK | W_OK) != 0 || ::stat(path.c_str(), &status) != 0)
    return not_opened(text, errno, group, if_absent);
  if (!S_ISCHR(status.st_mode)) return {Level::kFail, kSubject, text + " is not a device", if_absent};
  return {Level::kOk, kSubject, text + " can be opened", ""};
}

/// As the backend opens it, but for TIOCEXCL, which would stay set for others that have it open.
Finding serial_line(const std::string& what, const std::string& path, const std::string& robot,
                    const std::string& if_absent) {
  const std::string text = fmt::format("{}: {}", what, path);
  const auto taken = [&]() -> Finding {
    const bool is_ours = is_up(robot);
    return {is_ours ? Level::kWarn : Level::kFail, kSubject, text + ": another program has it open",
            is_ours ? "nothing, if that is this robot, which is up"
                    : fmt::format("end that program; 'fuser {}' shows which", path)};
  };
  // Not blocking, or open() would wait for a modem's carrier.
  const int fd = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return errno == EBUSY ? taken() : not_opened(text, errno, "dialout", if_absent);
  const bool is_line = ::isatty(fd) == 1;
  const bool is_free = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  ::close(fd);  // and the lock with it
  if (!is_line) return {Level::kFail, kSubject, text + " is not a serial line", if_absent};
  if (!is_free) return taken();
  return {Level::kOk, kSubject, text + " can be opened", ""};
}

Finding pwm(const PwmSysfsOptions& options) {
  const std::string what = "backend pwm_sysfs: " + options.chip;
  const std::string use = options.chip + "/export";
  if (::access(use.c_str(), W_OK) == 0) return {Level::kOk, kSubject, what + " can be used", ""};
  if (errno == EACCES) {
    return {Level::kFail, kSubject, what + ": Permission denied",
            "install packaging/udev and join the group gpio"};
  }
  return {Level::kFail, kSubject, what + ": is not a PWM controller",
          "load its driver (on a Raspberry Pi: dtoverlay=pwm-2chan), or correct backend.pwm_sysfs.chip; "
          "ls /sys/class/pwm lists them"};
}

/// The CAN interface of a profile, or the socket of a virtual bus.
Finding can_interface(const std::string& name) {
  const std::string what = "backend socketcan: " + name;
  const std::string emulate = fmt::format("start the drives' side: corbot-sim cia402 --can {}", name);
  if (name.starts_with("unix:")) {
    if (::access(name.c_str() + 5, R_OK | W_OK) == 0) return {Level::kOk, kSubject, what + " is there", ""};
    return {Level::kFail, kSubject, fmt::format("{}: {}", what, std::strerror(errno)), emulate};
  }
  const std::string files = "/sys/class/net/" + name;
  constexpr int kCanType = 280;  // ARPHRD_CAN
  std::ifstream type_file(files + "/type");
  int type = 0;
  if (!(type_file >> type)) {
    return {Level::kFail, kSubject, what + ": no such interface",
            "plug the adapter in (ip link shows it), or correct backend.socketcan.interface in the profile"};
  }
  if (type != kCanType) {
    return {Level::kFail, kSubject, what + " is not a CAN interface",
            "correct backend.socketcan.interface in the profile"};
  }
  unsigned flags = 0;
  std::ifstream(files + "/flags") >> std::hex >> flags;
  if ((flags & IFF_UP) == 0) {
    return {Level::kFail, kSubject, what + " is down",
            fmt::format("sudo ip link set {} up type can bitrate 1000000", name)};
  }
  return {Level::kOk, kSubject, what + " is up", ""};
}

/// Lines of a chip. One that is in use may be held by this robot, which is up.
void gpio(const std::string& what, const std::string& chip, const std::vector<std::string>& lines,
          const std::string& key, std::vector<Finding>& findings) {
  findings.push_back(file(what, chip, "gpio", fmt::format("correct {}.chip; 'gpiodetect' lists them", key)));
  if (findings.back().level != Level::kOk) return;
  for (const std::string& line : lines) {
    const auto fault = rt::gpio_line_fault(chip, line);
    if (!fault) continue;
    const bool is_ours = fault->consumer.starts_with("corbot");
    findings.push_back(
        {is_ours ? Level::kWarn : Level::kFail, kSubject, fmt::format("{}: {}", what, fault->text),
         is_ours ? "nothing, if this robot is up"
                 : fmt::format("correct {}, or end the program that holds it; 'gpioinfo' shows it", key)});
  }
}

void backend(const BackendOptions& options, const std::string& robot, std::vector<Finding>& findings) {
  const std::string what = "backend " + options.kind;
  if (options.kind == "loopback") {
    findings.push_back({Level::kOk, kSubject, what + " (the simulator): needs none", ""});
  } else if (options.kind == "pca9685") {
    findings.push_back(file(what, options.pca9685.bus, "i2c",
                            "modprobe i2c-dev, switch the bus on (on a Raspberry Pi: dtparam=i2c_arm=on), or "
                            "correct backend.pca9685.bus"));
  } else if (options.kind == "pwm_sysfs") {
    findings.push_back(pwm(options.pwm_sysfs));
  } else if (options.kind == "socketcan") {
    findings.push_back(can_interface(options.socketcan.interface));
  } else if (options.kind == "gpiod") {
    gpio(what, options.gpiod.chip, options.gpiod.lines, "backend.gpiod", findings);
  } else {
    findings.push_back(serial_line(
        what, options.serial.port, robot,
        fmt::format("plug the controller in, or correct backend.{}.port in the profile", options.kind)));
  }
}

}  // namespace

std::vector<Finding> examine_devices(const Profile& profile) {
  std::vector<Finding> findings;
  backend(profile.backend, profile.name, findings);
  if (const auto& stop = profile.emergency_stop; !stop.chip.empty()) {
    gpio("emergency stop", stop.chip, {stop.line}, "emergency_stop", findings);
  }
  if (const auto& power = profile.power_enable; !power.chip.empty()) {
    gpio("power enable", power.chip, {power.line}, "power_enable", findings);
  }
  return findings;
}

}  // namespace corbot::cli
