// SPDX-License-Identifier: Apache-2.0
#include "config/schema.h"
#include "config/arms/four_axis.h"
#include "config/arms/recognise.h"
#include "config/backend_schema.h"
#include "config/output_schema.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"

namespace corbot {
namespace {

constexpr std::size_t kLynxJoints = 4;
constexpr double kPulseMinUs = 500.0;
constexpr double kPulseMaxUs = 2500.0;
/// Of a pulse computed at the end of a range: far below a servo's resolution, far above rounding.
constexpr double kPulseToleranceUs = 1e-6;

constexpr Bounds kAngle{-180, 180, false, "degrees"};  // beyond half a turn the inverse kinematics never goes
constexpr Bounds kPulse{kPulseMinUs, kPulseMaxUs, false, "us"};
constexpr Bounds kLength{0, 5, true, "m"};
/// Limits: positive, and small enough that no product of theirs overflows.
constexpr Bounds limit(std::string_view unit) { return {0, 1e6, true, unit}; }

/// A name at `key`, empty after a fault.
std::string read_name(Section& section, std::string_view key) {
  auto name = section.text(key);
  if (!name || is_name(*name)) return name.value_or("");
  section.refuse(key, "must be " + name_rule());
  return "";
}

void read_robot(Section section, Profile& profile) {
  profile.name = read_name(section, "name");
  if (const auto kind = section.text("kind"); kind && *kind != "anthropomorphic") {
    section.refuse("kind", "is not supported; supported: \"anthropomorphic\"");
  }
  profile.arm.kind = ArmKind::kAnthropomorphic;
  section.finish();
}

/// A length or an angle of the table; noted where it is missing or refused.
double read_length(Section& section, std::string_view key, const Bounds& bounds, bool& complete) {
  const auto length = section.number(key, bounds);
  complete = complete && length.has_value();
  return length.value_or(0);
}

/// The lengths are those of a D-H table, of which the family is recognised and verified.
void read_geometry(Section section, Kinematics& kinematics) {
  bool complete = true;
  config::FourAxisLengths lengths;
  lengths.l0_m = read_length(section, "l0_m", {0, 5, false, "m"}, complete);
  lengths.l1_m = read_length(section, "l1_m", kLength, complete);
  lengths.l2_m = read_length(section, "l2_m", kLength, complete);
  lengths.l3_m = read_length(section, "l3_m", kLength, complete);
  if (const auto offset = section.numbers("offset_deg", lengths.offset_rad.size(), kAngle)) {
    for (std::size_t i = 0; i < offset->size(); ++i)
      lengths.offset_rad[i] = (*offset)[i] * kRadiansPerDegree;
  } else {
    complete = false;
  }
  section.finish();
  if (!complete) return;
  const config::RecognisedArm arm = config::recognise_arm(config::four_axis_table(lengths));
  if (!has_tool_pitch(arm.kinematics)) section.refuse("l1_m", "gives no base and planar arm: " + arm.reason);
  kinematics = arm.kinematics;
}

/// The channels in use, each with its key, so that a fault can name both.
using ChannelUse = std::map<std::uint32_t, std::string>;

std::uint32_t read_channel(Section& section, ChannelUse& in_use) {
  const auto read = section.integer("channel", {0, 31, false, ""});
  if (!read) return 0;
  const auto channel = static_cast<std::uint32_t>(*read);
  const auto [user, is_new] = in_use.emplace(channel, section.full_key("channel"));
  if (!is_new)
    section.refuse("channel",
                   fmt::format("is used by {}; every servo needs a channel of its own", user->second));
  return channel;
}

/// Both ends of the joint's range must be pulses that the servo may be given.
void check_pulses(Section& joint, const std::array<double, 2>& range_deg, double zero_us,
                  double us_per_degree, double direction, const std::array<double, 2>& pulse_us) {
  for (const double angle : range_deg) {
    const double pulse = zero_us + direction * us_per_degree * angle;
    if (pulse >= pulse_us[0] - kPulseToleranceUs && pulse <= pulse_us[1] + kPulseToleranceUs) continue;
    joint.refuse("range_deg",
                 fmt::format("needs a pulse of {:.6g} us at {} degrees; pulse_range_us allows {} to {} us",
                             pulse, angle, pulse_us[0], pulse_us[1]));
  }
}

ServoMap read_servo(Section& joint, const std::optional<std::array<double, 2>>& range_deg,
                    ChannelUse& in_use) {
  Section section = joint.table("servo");
  ServoMap map;
  map.channel = read_channel(section, in_use);
  const auto zero = section.number("zero_us", {-10000, 10000, false, "us"});
  const auto scale = section.number("us_per_degree", {0, 1000, true, "us"});
  const auto direction = section.integer("direction", {-1, 1, false, "(1 or -1)"});
  if (direction && *direction == 0) section.refuse("direction", "must be 1 or -1");
  const auto pulses = section.range("pulse_range_us", kPulse);
  section.finish();
  if (!zero || !scale || !direction || *direction == 0 || !pulses) return map;
  map.zero_us = *zero;
  map.us_per_q = *scale / kRadiansPerDegree;
  map.direction = static_cast<double>(*direction);
  map.pulse_min_us = (*pulses)[0];
  map.pulse_max_us = (*pulses)[1];
  if (range_deg) check_pulses(joint, *range_deg, *zero, *scale, map.direction, *pulses);
  return map;
}

void read_joint(Section& section, std::size_t index, Profile& profile, ChannelUse& in_use) {
  JointLimits& limits = profile.arm.joints[index];
  const std::string name = read_name(section, "name");
  if (!name.empty() && std::count(profile.joint_names.begin(), profile.joint_names.end(), name) > 0) {
    section.refuse("name", "is the name of an earlier joint; names must differ");
  }
  profile.joint_names.push_back(name);
  const auto range = section.range("range_deg", kAngle);
  if (range) {
    limits.lower_q = (*range)[0] * kRadiansPerDegree;
    limits.upper_q = (*range)[1] * kRadiansPerDegree;
    if ((*range)[0] > 0 || (*range)[1] < 0) section.refuse("range_deg", "must contain 0, where Ready goes");
  }
  limits.speed_q_s = section.number("speed_deg_s", limit("degrees/s")).value_or(0) * kRadiansPerDegree;
  limits.acceleration_q_s2 =
      section.number("acceleration_deg_s2", limit("degrees/s^2")).value_or(0) * kRadiansPerDegree;
  limits.jerk_q_s3 = section.number("jerk_deg_s3", limit("degrees/s^3")).value_or(0) * kRadiansPerDegree;
  profile.arm.servos[index] = read_servo(section, range, in_use);
  FollowingLimits& following = profile.following.emplace_back();
  following.error_q =
      section.number_or("following_error_deg", 15, {0, 180, true, "degrees"}).value_or(0) * kRadiansPerDegree;
  following.time_s = section.number_or("following_error_s", 0.25, {0.001, 10, false, "s"}).value_or(0);
  following.goal_q =
      section.number_or("goal_tolerance_deg", 1, {0, 90, true, "degrees"}).value_or(0) * kRadiansPerDegree;
  section.finish();
}

void read_joints(Section& root, Profile& profile, ChannelUse& in_use) {
  auto joints = root.tables("joint");
  if (joints.empty()) return;
  if (joints.size() != kLynxJoints) {
    root.refuse(
        "joint",
        fmt::format(
            "are {} joints; an anthropomorphic arm of this family has {}: base, shoulder, elbow, wrist",
            joints.size(), kLynxJoints));
  }
  profile.arm.dof = kLynxJoints;
  for (std::size_t i = 0; i < std::min(joints.size(), kMaxJoints); ++i)
    read_joint(joints[i], i, profile, in_use);
}

void read_gripper(Section section, GripperModel& gripper, ChannelUse& in_use) {
  gripper.channel = read_channel(section, in_use);
  const auto closed = section.number("closed_us", kPulse);
  const auto open = section.number("open_us", kPulse);
  if (closed && open && *closed == *open) section.refuse("open_us", "must differ from closed_us");
  gripper.closed_us = closed.value_or(0);
  gripper.open_us = open.value_or(0);
  gripper.travel_s = section.number("travel_s", {0.01, 60, false, "s"}).value_or(0);
  section.finish();
}

void read_path(Section section, PathLimits& path) {
  path.speed_m_s = section.number("speed_m_s", limit("m/s")).value_or(0);
  path.acceleration_m_s2 = section.number("acceleration_m_s2", limit("m/s^2")).value_or(0);
  path.jerk_m_s3 = section.number("jerk_m_s3", limit("m/s^3")).value_or(0);
  path.rotation_speed_rad_s =
      section.number("turn_speed_deg_s", limit("degrees/s")).value_or(0) * kRadiansPerDegree;
  path.rotation_acceleration_rad_s2 =
      section.number("turn_acceleration_deg_s2", limit("degrees/s^2")).value_or(0) * kRadiansPerDegree;
  path.rotation_jerk_rad_s3 =
      section.number("turn_jerk_deg_s3", limit("degrees/s^3")).value_or(0) * kRadiansPerDegree;
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
  // 64 commands fit into the ring, and a motion is up to two.
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

void read_stop(Section section, StopOptions& stop) {
  stop.category =
      static_cast<int>(section.integer_or("category", 1, {0, 1, false, "(IEC 60204-1)"}).value_or(1));
  stop.ramp_s = section.number_or("ramp_s", 1.0, {0.05, 10, false, "s"}).value_or(1.0);
  section.finish();
}

}  // namespace

void read_schema(const toml::table& table, Profile& profile, FaultList& faults) {
  Section root{&table, "", faults};
  ChannelUse channels;
  read_robot(root.table("robot"), profile);
  read_geometry(root.table("geometry"), profile.arm.kinematics);
  read_joints(root, profile, channels);
  read_gripper(root.table("gripper"), profile.arm.gripper, channels);
  read_path(root.table("path"), profile.arm.path);
  read_loop(root.table_or_empty("loop"), profile);
  read_servant(root.table_or_empty("servant"), profile);
  read_supervisor(root.table_or_empty("supervisor"), profile.supervisor);
  read_stop(root.table_or_empty("stop"), profile.stop);
  const Section backend = root.table("backend");
  read_backend(backend, profile.arm.dof, profile.backend);
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
