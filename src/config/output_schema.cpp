// SPDX-License-Identifier: Apache-2.0
#include "config/output_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "corbot/kinematics/joints.h"

namespace corbot {
namespace {

// of a servo's frames; with a higher rate pulses of 2500 us do not fit
constexpr Bounds kFrameRate{40, 200, false, "Hz"};
constexpr std::uint32_t kPca9685Channels = 16;
constexpr std::uint32_t kMaestroChannels = 24;  // of the largest model
constexpr double kLongestAwake_us = 200.0;      // seven servos in a frame of 20 ms: 7 % of a processor
constexpr double kSlot_us = 2700.0;             // for a staggered pulse: the longest, plus time to be late

std::string read_path(Section& section, std::string_view key, std::string_view example) {
  std::string path = section.text(key).value_or("");
  if (section.has(key) && !path.starts_with('/')) {
    section.refuse(key, fmt::format("must be a path, such as {}", example));
  }
  return path;
}

void read_pca9685(Section section, Pca9685Options& options, CommonBackendOptions& common) {
  options.bus = read_path(section, "bus", "/dev/i2c-1");
  options.address =
      static_cast<int>(section.integer_or("address", options.address, {0x08, 0x77, false, ""}).value_or(0));
  options.frame_hz = section.number_or("frame_hz", options.frame_hz, kFrameRate).value_or(0);
  options.oscillator_hz =
      section.number_or("oscillator_hz", options.oscillator_hz, {20e6, 50e6, false, "Hz"}).value_or(0);
  common = read_common(section, false);
  section.finish();
}

void read_pwm_sysfs(Section section, PwmSysfsOptions& options, CommonBackendOptions& common) {
  options.chip = read_path(section, "chip", "/sys/class/pwm/pwmchip0");
  options.frame_hz = section.number_or("frame_hz", options.frame_hz, kFrameRate).value_or(0);
  common.relax_at_end = read_at_end(section);
  common.stagger_ms = read_stagger(section);
  section.finish();
}

void read_gpiod(Section section, GpiodOptions& options, CommonBackendOptions& common) {
  options.chip = read_path(section, "chip", "/dev/gpiochip0");
  options.lines = section.texts("lines", kMaxServos).value_or(std::vector<std::string>{});
  for (auto line = options.lines.begin(); line != options.lines.end(); ++line) {
    if (line->empty() || std::find(options.lines.begin(), line, *line) != line) {
      section.refuse("lines", "must be names or offsets of lines, each different and not empty");
      break;
    }
  }
  options.frame_hz = section.number_or("frame_hz", options.frame_hz, kFrameRate).value_or(0);
  const std::string pulses = section.text_or("pulses", "staggered").value_or("staggered");
  if (pulses != "staggered" && pulses != "together") {
    section.refuse("pulses", "must be \"staggered\" or \"together\"");
  }
  options.staggered = pulses == "staggered";
  if (options.staggered && static_cast<double>(options.lines.size()) * kSlot_us > 1e6 / options.frame_hz) {
    section.refuse("lines", fmt::format("are too many for staggered pulses in a frame of {:.4g} us, {} us "
                                        "each: set pulses = \"together\"",
                                        1e6 / options.frame_hz, kSlot_us));
  }
  options.priority = static_cast<int>(
      section.integer_or("priority", 0, {0, 99, false, "(0: one above the loop's)"}).value_or(0));
  options.cpu = static_cast<int>(section.integer_or("cpu", -1, {-1, 1023, false, "(-1: any)"}).value_or(-1));
  options.awake_us =
      section.number_or("awake_us", options.awake_us, {0, kLongestAwake_us, false, "us"}).value_or(0);
  common.stagger_ms = read_stagger(section);
  section.finish();
}

/// Reads a table, which is required if `kind` names it, and checked whenever it exists.
template <class Options>
bool read_one(Section& section, std::string_view name, BackendOptions& backend,
              void (*read)(Section, Options&, CommonBackendOptions&), Options& options) {
  CommonBackendOptions unused;
  const bool is_chosen = backend.kind == name;
  if (is_chosen || section.has(name)) read(section.table(name), options, is_chosen ? backend.common : unused);
  return is_chosen;
}

/// Reads a chip and one of its lines.
void read_line(Section& section, std::string& chip, std::string& line) {
  chip = read_path(section, "chip", "/dev/gpiochip0");
  line = section.text("line").value_or("");
  if (section.has("line") && line.empty()) section.refuse("line", "must be a line's name, or its offset");
}

}  // namespace

bool read_at_end(Section& section) {
  const std::string at_end = section.text_or("at_end", "hold").value_or("hold");
  if (at_end != "hold" && at_end != "relax") section.refuse("at_end", "must be \"hold\" or \"relax\"");
  return at_end == "relax";
}

int read_stagger(Section& section) {
  constexpr int kDefault_ms = CommonBackendOptions{}.stagger_ms;
  return static_cast<int>(
      section.integer_or("stagger_ms", kDefault_ms, {0, 2000, false, "ms (0: all at once)"})
          .value_or(kDefault_ms));
}

CommonBackendOptions read_common(Section& section, bool default_readback) {
  CommonBackendOptions common;
  common.stagger_ms = read_stagger(section);
  common.readback = section.flag_or("readback", default_readback).value_or(default_readback);
  common.relax_at_end = read_at_end(section);
  return common;
}

bool read_active_low(Section& section, std::string_view key, bool fallback) {
  const std::string usual = fallback ? "low" : "high";
  const std::string active = section.text_or(key, usual).value_or(usual);
  if (active != "high" && active != "low") section.refuse(key, "must be \"high\" or \"low\"");
  return active == "low";
}

bool read_outputs(Section& section, BackendOptions& backend) {
  bool known = read_one(section, "pca9685", backend, read_pca9685, backend.pca9685);
  known |= read_one(section, "pwm_sysfs", backend, read_pwm_sysfs, backend.pwm_sysfs);
  known |= read_one(section, "gpiod", backend, read_gpiod, backend.gpiod);
  return known;
}

void check_channels(Section section, const BackendOptions& backend,
                    const std::map<std::uint32_t, std::string>& channels) {
  const bool is_gpiod = backend.kind == "gpiod";
  const bool is_maestro = backend.kind == "maestro";
  if (!is_gpiod && !is_maestro && backend.kind != "pca9685") return;
  const auto count = is_gpiod     ? static_cast<std::uint32_t>(backend.gpiod.lines.size())
                     : is_maestro ? kMaestroChannels
                                  : kPca9685Channels;
  for (const auto& [channel, key] : channels) {
    if (channel < count || count == 0) continue;
    section.refuse("kind",
                   fmt::format("has channels 0 to {}{}, but {} is {}", count - 1,
                               is_gpiod ? ", one for each of backend.gpiod.lines" : "", key, channel));
  }
}

void read_emergency_stop(Section section, EmergencyStopOptions& options) {
  read_line(section, options.chip, options.line);
  options.active_low = read_active_low(section, "active", false);
  options.bias = section.text_or("bias", options.bias).value_or("");
  static constexpr std::array<std::string_view, 4> kKnown{"pull-up", "pull-down", "none", "as-is"};
  if (std::find(kKnown.begin(), kKnown.end(), options.bias) == kKnown.end()) {
    section.refuse("bias", "must be \"pull-up\", \"pull-down\", \"none\" or \"as-is\"");
  }
  section.finish();
}

void read_power_enable(Section section, Profile& profile) {
  PowerEnableOptions& options = profile.power_enable;
  read_line(section, options.chip, options.line);
  options.active_low = read_active_low(section, "active", false);
  options.off_at_stop = section.flag_or("off_at_stop", true).value_or(true);
  if (!options.off_at_stop && profile.stop.category == 0)
    section.refuse("off_at_stop",
                   "contradicts stop.category = 0, which switches the power off at once: set it to true, or "
                   "category = 1");
  section.finish();
}

void read_watchdog(Section section, Profile& profile) {
  WatchdogOptions& options = profile.watchdog;
  read_line(section, options.chip, options.line);
  options.active_low = read_active_low(section, "active", false);
  const double period_ms = section.number_or("period_ms", 10, {2, 1000, false, "ms"}).value_or(10);
  options.period_ns = static_cast<std::int64_t>(period_ms * 1e6);
  // A cycle takes one period of the loop, and is occasionally late.
  if (options.period_ns < profile.arm.period_ns) {
    section.refuse("period_ms", fmt::format("must be at least the period of the loop, {} ms",
                                            static_cast<double>(profile.arm.period_ns) * 1e-6));
  }
  const auto is_taken = [&](const std::string& chip, const std::string& line) {
    return !chip.empty() && chip == options.chip && line == options.line;
  };
  if (is_taken(profile.power_enable.chip, profile.power_enable.line))
    section.refuse("line", "is the line of power_enable: use another line");
  if (is_taken(profile.emergency_stop.chip, profile.emergency_stop.line))
    section.refuse("line", "is the line of emergency_stop: use another line");
  section.finish();
}

}  // namespace corbot
