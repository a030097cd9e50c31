// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <optional>

#include "cli/doctor/device_findings.h"
#include "rt/safety_settings.h"

namespace corbot::cli {

namespace {

struct Lines {
  std::string what;  ///< "emergency stop"
  std::string key;   ///< in the profile
  std::string chip;
};

std::string describe_consumer(const std::string& consumer) {
  return consumer.empty() ? "the kernel or a nameless program" : fmt::format("\"{}\"", consumer);
}

/// Returns the kernel's information on one line, without requesting the line. Returns nothing if the line
/// does not exist or is in use.
std::optional<rt::GpioLineInfo> examine_line(const Lines& lines, const std::string& line,
                                             const DeviceAccess& access, bool is_up, Findings& findings) {
  const std::string text = fmt::format("{}: {}, line {}", lines.what, lines.chip, line);
  try {
    rt::GpioLineInfo info = access.gpio->info(lines.chip, line);
    if (!info.consumer) return info;
    const bool is_ours = info.consumer->starts_with("corbot");
    const std::string held = fmt::format("{} is held by {}", text, describe_consumer(*info.consumer));
    if (is_ours && is_up) {
      findings.push_back(device_ok(held));
    } else {
      findings.push_back(device_failure(
          held, fmt::format("correct {}, or end the program that holds it; 'gpioinfo' shows it", lines.key)));
    }
  } catch (const rt::DeviceError& error) {
    findings.push_back(device_failure(fmt::format("{}: {}", lines.what, error.what()),
                                      fmt::format("correct {}; 'gpioinfo' lists the lines", lines.key)));
  }
  return std::nullopt;
}

/// Returns the level of an input. Requests the line like corbot-rt.
std::optional<bool> level_of(const rt::GpioRequest& request, const Lines& lines, const DeviceAccess& access,
                             Findings& findings) {
  try {
    return access.gpio->input(request)->is_active();
  } catch (const rt::DeviceError& error) {
    findings.push_back(
        device_failure(fmt::format("{}: {}", lines.what, error.what()), "correct " + lines.key));
    return std::nullopt;
  }
}

bool is_there(const Lines& lines, Findings& findings) {
  findings.push_back(device_file(lines.what, lines.chip, "gpio",
                                 fmt::format("correct {}.chip; 'gpiodetect' lists them", lines.key)));
  return findings.back().level == Level::kOk;
}

void examine_stop(const rt::GpioRequest& request, const DeviceAccess& access, bool is_up,
                  Findings& findings) {
  const Lines lines{"emergency stop", "emergency_stop", request.chip};
  if (!is_there(lines, findings)) return;
  if (!examine_line(lines, request.lines[0], access, is_up, findings) || is_up) return;
  const auto level = level_of(request, lines, access, findings);
  if (!level) return;
  const std::string text = fmt::format("{}: line {}", lines.what, request.lines[0]);
  if (*level) {
    findings.push_back(device_warning(
        text + " is pressed",
        "release the emergency stop; if the button is released, correct emergency_stop.active or bias"));
  } else {
    findings.push_back(device_ok(text + " is not pressed"));
  }
}

/// Examines an output of corbot. While no process holds the line, reading it as an input shows the effect of
/// the wiring. A line that is still an output is left alone, as a request could change it.
void examine_output(const Lines& lines, rt::GpioRequest request, const std::string& if_active,
                    const DeviceAccess& access, bool is_up, Findings& findings) {
  if (!is_there(lines, findings)) return;
  const auto info = examine_line(lines, request.lines[0], access, is_up, findings);
  if (!info || is_up) return;
  const std::string text = fmt::format("{}: line {}", lines.what, request.lines[0]);
  if (info->is_output) {
    findings.push_back(
        device_ok(text + " is free, and an output; its level is not asked for, which could change it"));
    return;
  }
  request.bias = rt::GpioBias::kAsIs;
  const auto level = level_of(request, lines, access, findings);
  if (!level) return;
  if (*level) {
    findings.push_back(device_warning(text + " is active while corbot does not drive it", if_active));
  } else {
    findings.push_back(device_ok(text + " is free, and inactive"));
  }
}

}  // namespace

void examine_lines(const Profile& profile, const DeviceAccess& access, bool is_up, Findings& findings) {
  if (profile.backend.kind == "gpiod") {
    const GpiodOptions& options = profile.backend.gpiod;
    const Lines lines{"backend gpiod", "backend.gpiod", options.chip};
    if (is_there(lines, findings)) {
      std::size_t free = 0;
      for (const std::string& line : options.lines) {
        if (examine_line(lines, line, access, is_up, findings)) ++free;
      }
      if (free > 0) findings.push_back(device_ok(fmt::format("{}: {} lines are free", lines.what, free)));
    }
  }
  const rt::SafetySettings settings = rt::safety_settings(profile);
  if (settings.stop) examine_stop(*settings.stop, access, is_up, findings);
  if (settings.power) {
    examine_output(
        {"power enable", "power_enable", settings.power->chip}, *settings.power,
        "the servos have power without corbot: wire a resistor that pulls the line to inactive, or correct "
        "power_enable.active",
        access, is_up, findings);
  }
  if (settings.watchdog) {
    examine_output({"watchdog", "watchdog", settings.watchdog->chip}, *settings.watchdog,
                   "a charge pump needs no change, because it takes edges; else correct watchdog.active",
                   access, is_up, findings);
  }
}

}  // namespace corbot::cli
