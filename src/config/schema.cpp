// SPDX-License-Identifier: Apache-2.0
#include "config/schema.h"
#include "config/backend_schema.h"
#include "config/geometry_schema.h"
#include "config/joint_schema.h"
#include "config/output_schema.h"
#include "config/workspace_schema.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "corbot/motion/longest_stop.h"
#include "corbot/units.h"

namespace corbot {
namespace {

void read_robot(Section& section, Profile& profile) {
  profile.name = read_name(section, "name");
  profile.arm.orientation_error_rad =
      section.number_or("orientation_error_deg", 0, {0, 180, false, "degrees"}).value_or(0) *
      kRadiansPerDegree;
  section.skip("kind");  // the recognition of the geometry checks it
  section.finish();
}

void read_path(Section section, PathLimits& path) {
  path.speed_m_s = section.number("speed_m_s", limit("m/s")).value_or(0);
  path.acceleration_m_s2 = section.number("acceleration_m_s2", limit("m/s^2")).value_or(0);
  path.jerk_m_s3 = section.number("jerk_m_s3", limit("m/s^3")).value_or(0);
  const auto rotation = [&section](std::string_view key, std::string_view older, std::string_view unit) {
    const bool is_older = section.has(older) && !section.has(key);
    if (section.has(older) && !is_older)
      section.refuse(older, fmt::format("is an older name of {}: write only that one", key));
    section.skip(older);
    return section.number(is_older ? older : key, limit(unit)).value_or(0) * kRadiansPerDegree;
  };
  path.rotation_speed_rad_s = rotation("rotation_speed_deg_s", "turn_speed_deg_s", "degrees/s");
  path.rotation_acceleration_rad_s2 =
      rotation("rotation_acceleration_deg_s2", "turn_acceleration_deg_s2", "degrees/s^2");
  path.rotation_jerk_rad_s3 = rotation("rotation_jerk_deg_s3", "turn_jerk_deg_s3", "degrees/s^3");
  section.finish();
}

/// A few missed periods are no fault.
constexpr std::int64_t kGapFaultPeriods = 5;

std::int64_t to_ns(double seconds) { return std::llround(seconds * 1e9); }

void read_loop(Section section, Profile& profile) {
  profile.arm.period_ns = section.integer_or("period_us", 1000, {250, 20000, false, "us"}).value_or(0) * 1000;
  profile.priority = static_cast<int>(section.integer_or("priority", 80, {1, 98, false, ""}).value_or(0));
  profile.cpu = static_cast<int>(section.integer_or("cpu", -1, {-1, 1023, false, "(-1: any)"}).value_or(0));
  const auto gap_ms = section.integer_or("gap_fault_ms", 100, {10, 10000, false, "ms"});
  profile.gap_fault_ns = gap_ms.value_or(0) * 1'000'000;
  const std::int64_t shortest_ns = kGapFaultPeriods * profile.arm.period_ns;
  if (gap_ms && profile.gap_fault_ns < shortest_ns) {
    section.refuse("gap_fault_ms", fmt::format("must be at least {} periods, {} ms", kGapFaultPeriods,
                                               (shortest_ns + 999'999) / 1'000'000));
  }
  profile.frozen_ns = section.integer_or("frozen_ms", 100, {60, 10000, false, "ms"}).value_or(0) * 1'000'000;
  profile.orphan_ns = to_ns(section.number_or("orphan_s", 2.0, {0.5, 60, false, "s"}).value_or(0));
  profile.settle_s = section.number_or("settle_s", 1.0, {0.1, 60, false, "s"}).value_or(1.0);
  section.finish();
}

bool is_host(const std::string& text) {
  return !text.empty() && text.size() <= 255 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == ':';
  });
}

void read_servant(Section section, Profile& profile) {
  if (const auto host = section.text_or("host", profile.endpoint_host)) {
    if (!is_host(*host)) section.refuse("host", "must be a host name or an IP address to listen on");
    profile.endpoint_host = *host;
  }
  profile.port = static_cast<int>(section.integer_or("port", 12810, {1, 65535, false, ""}).value_or(0));
  // The ring has space for 64 commands, and a motion has up to two.
  profile.queue_capacity =
      static_cast<int>(section.integer_or("queue", 16, {1, 32, false, "motions"}).value_or(0));
  section.finish();
}

void read_supervisor(Section section, SupervisorOptions& options) {
  options.respond_s = section.number_or("respond_s", options.respond_s, {0.5, 60, false, "s"}).value_or(0);
  options.attempts = static_cast<int>(
      section.integer_or("attempts", options.attempts, {0, 1000, false, "(0: endless)"}).value_or(0));
  section.finish();
}

/// Reads [stop]. The power stays on for as long as the arm may need to come to rest on its path. Another
/// check doubts limits for which no ramp_s is long enough. `is_whole`: the limits have been read.
void read_stop(Section section, const ArmModel& arm, bool is_whole, StopOptions& stop) {
  stop.category =
      static_cast<int>(section.integer_or("category", 1, {0, 1, false, "(IEC 60204-1)"}).value_or(1));
  const double found_s = is_whole ? rate::longest_stop_s(arm) : 0.0;
  const double longest_s = found_s > rate::kLongestStop_s ? 0.0 : found_s;
  const auto ramp_s = section.number_or("ramp_s", std::max(1.0, longest_s), {0.05, 10, false, "s"});
  stop.ramp_s = ramp_s.value_or(1.0);
  if (ramp_s && *ramp_s < longest_s)
    section.refuse("ramp_s", fmt::format("must be a number from {:.3g} s, the duration of the longest stop "
                                         "by the limits of this profile, to 10 s",
                                         longest_s));
  section.finish();
}

}  // namespace

void read_schema(const toml::table& table, Profile& profile, FaultList& faults) {
  Section root{&table, "", faults};
  ChannelUse channels;
  const bool needs_servos = sends_pulses(table["backend"]["kind"].value_or(std::string_view{}));
  Section robot = root.table("robot");
  read_robot(robot, profile);
  Section geometry = root.table("geometry");
  GeometryInput input = read_geometry(root, geometry, profile.file);
  read_joints(root, profile, input, needs_servos, channels);
  recognise_geometry(robot, geometry, input, profile.joint_names.size(), profile);
  read_gripper(root.table("gripper"), profile, needs_servos, channels);
  read_path(root.table("path"), profile.arm.path);
  read_workspace(root.table_or_empty("workspace"), profile.arm);
  read_loop(root.table_or_empty("loop"), profile);
  read_servant(root.table_or_empty("servant"), profile);
  read_supervisor(root.table_or_empty("supervisor"), profile.supervisor);
  read_stop(root.table_or_empty("stop"), profile.arm, faults.faults.empty(), profile.stop);
  const Section backend = root.table("backend");
  read_backend(backend, input.joints, profile.backend);
  if (!needs_servos) fit_servos(profile, channels);
  check_channels(backend, profile.backend, channels);
  const Section stop = root.table_or_empty("emergency_stop");
  if (root.has("emergency_stop")) read_emergency_stop(stop, profile.emergency_stop);
  const Section power = root.table_or_empty("power_enable");
  if (root.has("power_enable")) read_power_enable(power, profile);
  const Section watchdog = root.table_or_empty("watchdog");
  if (root.has("watchdog")) read_watchdog(watchdog, profile);
  root.finish();
}

}  // namespace corbot
