// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "cli/doctor/device_findings.h"
#include "client/explain.h"
#include "rt/backends/serial/maestro.h"
#include "rt/backends/serial/ssc32.h"

namespace corbot::cli {

namespace {

namespace fs = std::filesystem;

/// Examines a socket in place of a line, opened like the backend does.
Finding socket_line(const std::string& what, const std::string& path, const std::string& if_absent) {
  try {
    rt::SerialPort().open(path, 0);
    return device_ok(fmt::format("{}: {} can be opened", what, path));
  } catch (const rt::DeviceError& error) {
    return device_failure(fmt::format("{}: {}", what, error.what()), if_absent);
  }
}

/// Opens the line like the backend, but without TIOCEXCL, which would stay set for other processes that have
/// it open.
Finding serial_line(const std::string& what, const std::string& path, const std::string& if_absent) {
  const std::string text = fmt::format("{}: {}", what, path);
  const auto taken = [&] {
    return device_failure(text + ": another program has it open",
                          fmt::format("end that program; 'fuser {}' shows which", path));
  };
  // Non-blocking, or open() would wait for a modem's carrier.
  const int fd = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return errno == EBUSY ? taken() : not_opened(text, errno, "dialout", if_absent);
  const bool is_line = ::isatty(fd) == 1;
  const bool is_free = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  ::close(fd);  // also releases the lock
  if (!is_line) return device_failure(text + " is not a serial line", if_absent);
  if (!is_free) return taken();
  return device_ok(text + " can be opened");
}

std::string first_word(const fs::path& file) {
  std::ifstream stream(file);
  std::string word;
  stream >> word;
  return word;
}

/// The USB device behind a line, from sysfs.
struct UsbDevice {
  std::string vendor;   ///< "1ffb"
  std::string product;  ///< number
  std::string name;     ///< the device's own name
  std::string interface;
  std::string latency_ms;  ///< only an FTDI adapter has it
};

std::optional<UsbDevice> usb_of(const std::string& path, const std::string& sys) {
  std::error_code error;
  const fs::path line = fs::canonical(path, error).filename();
  fs::path place = error ? fs::path() : fs::canonical(fs::path(sys) / "class/tty" / line / "device", error);
  if (error) return std::nullopt;
  UsbDevice device;
  device.latency_ms = first_word(place / "latency_timer");
  // Goes up from the line's directory to the interface and to its device.
  for (int up = 0; up < 3; ++up, place = place.parent_path()) {
    if (device.interface.empty()) device.interface = first_word(place / "bInterfaceNumber");
    device.vendor = first_word(place / "idVendor");
    if (device.vendor.empty()) continue;
    device.product = first_word(place / "idProduct");
    std::ifstream name(place / "product");
    std::getline(name, device.name);
    return device;
  }
  return std::nullopt;
}

/// Returns the model by Pololu's product numbers.
const char* maestro_of(const UsbDevice& usb) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 4> kKinds{
      {{"0089", "Micro Maestro, 6 channels"},
       {"008a", "Mini Maestro, 12 channels"},
       {"008b", "Mini Maestro, 18 channels"},
       {"008c", "Mini Maestro, 24 channels"}}};
  if (usb.vendor != "1ffb") return nullptr;
  for (const auto& [product, kind] : kKinds) {
    if (usb.product == product) return kind;
  }
  return nullptr;
}

void examine_ssc32(const Profile& profile, const DeviceAccess& access, Findings& findings) {
  const SerialOptions& options = profile.backend.serial;
  const auto with = [&](int baud, char stop_input) {
    rt::Ssc32Settings settings;
    settings.port = options.port;
    settings.baud = baud;
    settings.servos = profile.arm.dof + 1;
    settings.stop_input = stop_input;
    settings.stop_at_high = options.stop_at_high;
    return rt::Ssc32(settings, access.serial());
  };
  try {
    rt::Ssc32 device = with(options.baud, 0);
    findings.push_back(device_ok(device.open()));
  } catch (const rt::DeviceError& error) {
    for (const int other : {9600, 38400, 115200, 2400}) {
      if (!rt::is_noise(error.cause()) || other == options.baud) continue;
      try {
        rt::Ssc32 device = with(other, 0);
        (void)device.open();
      } catch (const rt::DeviceError&) {
        continue;
      }
      findings.push_back(device_failure(
          fmt::format("backend ssc32: {}: an SSC-32 answers at {} baud, not at {}", options.port, other,
                      options.baud),
          fmt::format("backend.ssc32.baud = {}, or set the controller to {} (docs/wiring/ssc32.md)", other,
                      options.baud)));
      return;
    }
    findings.push_back(device_failure(fmt::format("backend ssc32: {}", error.what()),
                                      "switch the controller on, check the cable and its baud jumpers"));
    return;
  }
  if (options.stop_input == 0) return;
  const std::string input = fmt::format("backend ssc32: stop input {}", options.stop_input);
  try {
    // The loop exceeds the device's own deadline, so that an input without replies does not count as
    // released. It repeats from the beginning, since one late reply is enough for 'unheard'.
    constexpr int kLooks = 8;
    constexpr int kAttempts = 5;
    auto state = rt::StopInputLevel::kUnheard;
    for (int attempt = 0; attempt < kAttempts && state == rt::StopInputLevel::kUnheard; ++attempt) {
      rt::Ssc32 device = with(options.baud, options.stop_input);
      (void)device.open();
      state = rt::StopInputLevel::kReleased;
      for (int i = 0; i < kLooks && state == rt::StopInputLevel::kReleased; ++i)
        state = device.emergency_stop();
    }
    if (state == rt::StopInputLevel::kUnheard)
      throw rt::DeviceError(DeviceCause::kNoAnswer, "does not answer");
    if (state == rt::StopInputLevel::kPressed) {
      findings.push_back(device_warning(
          input + " is pressed",
          "release the emergency stop; if the button is released, correct backend.ssc32.stop_active"));
    } else {
      findings.push_back(device_ok(input + " is not pressed"));
    }
  } catch (const rt::DeviceError& error) {
    findings.push_back(
        device_failure(fmt::format("{}: {}", input, error.what()),
                       "corbot takes an input that cannot be read for pressed: check the line"));
  }
}

void examine_maestro(const Profile& profile, const DeviceAccess& access, const std::optional<UsbDevice>& usb,
                     Findings& findings) {
  const SerialOptions& options = profile.backend.serial;
  const std::string what = "backend maestro: " + options.port;
  const char* kind = usb ? maestro_of(*usb) : nullptr;
  rt::MaestroSettings settings;
  settings.port = options.port;
  settings.baud = options.baud;
  settings.device_number = options.device_number;
  settings.crc = options.crc;
  settings.detect_baud = options.detect_baud;
  settings.servos = profile.arm.dof + 1;
  rt::Maestro device(settings, access.serial());
  try {
    const unsigned errors = device.identify();
    const std::string text = fmt::format("{}: a Maestro answers{}{}", what, kind == nullptr ? "" : ": ",
                                         kind == nullptr ? "" : kind);
    if (errors == 0) {
      findings.push_back(device_ok(text + ", its error register is empty"));
    } else {
      findings.push_back(device_warning(
          fmt::format("{}; its error register had: {}", text, rt::Maestro::describe_errors(errors)),
          "reading it has cleared it; if it comes back, check the serial line and the settings"));
    }
  } catch (const rt::DeviceError& error) {
    findings.push_back(device_failure(
        fmt::format("backend maestro: {}", error.what()),
        "switch it on; check serial mode, baud, CRC and device number in Pololu's Maestro Control Center"));
    return;
  }
  if (options.multi_target && kind != nullptr && usb->product == "0089") {
    findings.push_back(device_failure(what + ": a Micro Maestro has no Set Multiple Targets",
                                      "remove backend.maestro.multi_target"));
  }
}

}  // namespace

void examine_serial(const Profile& profile, const DeviceAccess& access, Findings& findings) {
  const BackendOptions& options = profile.backend;
  const std::string what = "backend " + options.kind;
  const std::string& port = options.serial.port;
  const bool is_socket = rt::SerialPort::is_socket(port);
  findings.push_back((is_socket ? socket_line : serial_line)(
      what, port,
      fmt::format("plug the controller in, or correct backend.{}.port in the profile", options.kind)));
  if (findings.back().level != Level::kOk) return;
  const auto usb = is_socket ? std::nullopt : usb_of(port, access.sys);
  if (usb) {
    findings.back().text += fmt::format(
        "; USB {}:{}{}{}{}", usb->vendor, usb->product, usb->name.empty() ? "" : " ",
        client::printable(usb->name), usb->latency_ms.empty() ? "" : ", latency " + usb->latency_ms + " ms");
  }
  if (options.kind == "maestro" && usb && maestro_of(*usb) != nullptr && usb->interface == "02") {
    findings.push_back(device_failure(
        fmt::format(
            "{}: {} is the Maestro's TTL port, which does not take commands from USB in dual-port mode", what,
            port),
        "name its command port, the lower of the two numbers; or packaging/udev, which calls it "
        "/dev/maestro"));
    return;
  }
  if (options.kind == "ssc32") {
    examine_ssc32(profile, access, findings);
  } else if (options.kind == "maestro") {
    examine_maestro(profile, access, usb, findings);
  } else {
    findings.push_back(
        device_ok(what + " never answers: nothing shows whether it is there, or at this baud"));
  }
}

}  // namespace corbot::cli
