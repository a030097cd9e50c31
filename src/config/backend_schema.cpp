// SPDX-License-Identifier: Apache-2.0
#include "config/backend_schema.h"
#include "config/can_schema.h"
#include "config/output_schema.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/similar.h"

namespace corbot {
namespace {

void read_loopback(Section section, LoopbackOptions& options, CommonBackendOptions& common) {
  const LoopbackOptions defaults;
  options.frame_hz = section.number_or("frame_hz", defaults.frame_hz, {1, 1000, false, "Hz"}).value_or(0);
  options.rate_us_per_s =
      section.number_or("rate_us_per_s", defaults.rate_us_per_s, {1, 1e6, false, "us/s"}).value_or(0);
  options.dead_band_us =
      section.number_or("dead_band_us", defaults.dead_band_us, {0, 100, false, "us"}).value_or(0);
  options.lag_s = section.number_or("lag_s", defaults.lag_s, {0, 10, false, "s"}).value_or(0);
  common.readback = section.flag_or("readback", false).value_or(false);
  section.finish();
}

bool is_line(std::string_view port) {
  constexpr std::string_view kUnix = "unix:";
  if (!port.starts_with(kUnix)) return port.starts_with('/');
  port.remove_prefix(kUnix.size());
  return port.starts_with('/') && port.size() > 1 && port.size() <= kLongestSocket;
}

/// Features of a kind of serial controller.
struct SerialKind {
  std::string_view name;
  std::initializer_list<int> bauds;
  int default_baud;
  bool has_replies;
};

void read_serial(Section& section, const SerialKind& kind, SerialOptions& options,
                 CommonBackendOptions& common) {
  options.port = section.text("port").value_or("");
  if (section.has("port") && !is_line(options.port)) {
    section.refuse("port",
                   fmt::format("must be the path of a serial line, such as /dev/ttyUSB0, or unix:/PATH of a "
                               "socket, where PATH has at most {} bytes",
                               kLongestSocket));
  }
  options.baud = static_cast<int>(
      section.integer_or("baud", kind.default_baud, {1, 1e7, false, ""}).value_or(kind.default_baud));
  if (std::find(kind.bauds.begin(), kind.bauds.end(), options.baud) == kind.bauds.end()) {
    std::string known;
    for (const int baud : kind.bauds) known += (known.empty() ? "" : ", ") + std::to_string(baud);
    section.refuse("baud", "must be one of " + known);
  }
  if (kind.has_replies) {
    common = read_common(section, false);
  } else {
    common.stagger_ms = read_stagger(section);
  }
}

void read_ssc32(Section section, SerialOptions& options, CommonBackendOptions& common) {
  read_serial(section, {"ssc32", {2400, 9600, 38400, 115200}, 115200, true}, options, common);
  const std::string input = section.text_or("stop_input", "").value_or("");
  if (section.has("stop_input") && (input.size() != 1 || input[0] < 'A' || input[0] > 'F')) {
    section.refuse("stop_input", "must be an input, \"A\" to \"D\"; on an SSC-32U to \"F\"");
  }
  options.stop_input = input.size() == 1 ? input[0] : '\0';
  options.stop_at_high = !read_active_low(section, "stop_active", false);
  section.finish();
}

void read_maestro(Section section, SerialOptions& options, CommonBackendOptions& common) {
  read_serial(section, {"maestro", {9600, 19200, 38400, 57600, 115200}, 115200, true}, options, common);
  options.device_number = static_cast<int>(
      section.integer_or("device_number", -1, {-1, 127, false, "(-1: compact protocol)"}).value_or(-1));
  options.crc = section.flag_or("crc", false).value_or(false);
  options.multi_target = section.flag_or("multi_target", false).value_or(false);
  options.detect_baud = section.flag_or("detect_baud", false).value_or(false);
  section.finish();
}

void read_mini_ssc(Section section, SerialOptions& options, CommonBackendOptions& common) {
  read_serial(section, {"minissc", {2400, 9600}, 9600, false}, options, common);
  if (const auto range = section.has("pulse_range_us")
                             ? section.range("pulse_range_us", {500, 2500, false, "us"})
                             : std::array<double, 2>{500.0, 2500.0}) {
    options.first_us = (*range)[0];
    options.last_us = (*range)[1];
  }
  section.finish();
}

/// Every `kind` of `[backend]`.
constexpr std::array<std::string_view, 8> kBackendKinds{"loopback", "ssc32",     "maestro", "minissc",
                                                        "pca9685",  "pwm_sysfs", "gpiod",   "socketcan"};

}  // namespace

bool sends_pulses(std::string_view backend_kind) {
  return backend_kind != "loopback" && backend_kind != "socketcan" &&
         std::find(kBackendKinds.begin(), kBackendKinds.end(), backend_kind) != kBackendKinds.end();
}

void read_backend(Section section, std::span<const DrivenJoint> joints, BackendOptions& backend) {
  using Reader = void (*)(Section, SerialOptions&, CommonBackendOptions&);
  static constexpr std::pair<std::string_view, Reader> kSerialKinds[] = {
      {"ssc32", read_ssc32}, {"maestro", read_maestro}, {"minissc", read_mini_ssc}};
  backend.kind = section.text("kind").value_or("loopback");
  bool known = backend.kind == "loopback";
  backend.position_known_at_start = section.flag_or("position_known_at_start", known).value_or(false);
  // receives the values of the tables of other kinds, which are checked nevertheless
  CommonBackendOptions unused;
  read_loopback(section.table_or_empty("loopback"), backend.loopback, known ? backend.common : unused);
  for (const auto& [name, read] : kSerialKinds) {
    if (backend.kind == name) {
      known = true;
      read(section.table(name), backend.serial, backend.common);
    } else if (section.has(name)) {
      SerialOptions unused_serial;
      read(section.table(name), unused_serial, unused);
    }
  }
  known |= read_outputs(section, backend);
  if (backend.kind == "socketcan" || section.has("socketcan")) {
    const bool is_chosen = backend.kind == "socketcan";
    known |= is_chosen;
    read_socketcan(section.table("socketcan"), joints, backend.socketcan,
                   is_chosen ? backend.common : unused);
  }
  if (!known) {
    const std::string_view near = most_similar(backend.kind, kBackendKinds, kSimilarKey);
    section.refuse("kind",
                   fmt::format("is not supported; supported: \"{}\" (the simulator is \"loopback\"){}",
                               fmt::join(kBackendKinds, "\", \""),
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  }
  section.finish();
}

}  // namespace corbot
