// SPDX-License-Identifier: Apache-2.0
#include "state/last_position.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>

#include "corbot/arm/joint_units.h"
#include "corbot/channel/fingerprint.h"

namespace corbot {
namespace {

constexpr std::int64_t kFormat = 3;
constexpr std::size_t kMaxBootId = 64;
/// Far above the rounding of degrees, far below a servo's resolution.
constexpr double kTolerance_q = 1e-6;

std::tm parts_of(std::int64_t epoch_s) {
  const auto seconds = static_cast<std::time_t>(epoch_s);
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  return parts;
}

template <class Value>
Value required(const toml::table& table, std::string_view key) {
  const auto value = table[key].value_exact<Value>();
  if (!value) throw PositionError(fmt::format("{} is missing or of the wrong kind", key));
  return *value;
}

double finite(const toml::node& node, std::string_view key) {
  const auto value = node.value<double>();
  if (!node.is_number() || !value || !std::isfinite(*value))
    throw PositionError(fmt::format("{}: not a finite number", key));
  return *value;
}

std::uint64_t hexadecimal(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty())
    throw PositionError("profile: not a hexadecimal number");
  return value;
}

std::int64_t epoch_of(const toml::date_time& when) {
  std::tm parts{};
  parts.tm_year = when.date.year - 1900;
  parts.tm_mon = when.date.month - 1;
  parts.tm_mday = when.date.day;
  parts.tm_hour = when.time.hour;
  parts.tm_min = when.time.minute;
  parts.tm_sec = when.time.second;
  return ::timegm(&parts);
}

Joints read_joints(const toml::table& table, const ArmModel& arm) {
  const toml::array* array = table["joints"].as_array();
  const std::size_t dof = std::min<std::size_t>(arm.dof, kMaxJoints);
  if (array == nullptr || array->size() != dof)
    throw PositionError(fmt::format("joints: must be {} numbers", dof));
  Joints joints{};
  for (std::size_t i = 0; i < dof; ++i) {
    const JointKind kind = arm.kinematics.joint_kind(i);
    const double value = finite(*array->get(i), "joints");
    const JointLimits& limits = arm.joints[i];
    joints[i] = from_shown(kind, value);
    if (joints[i] < limits.lower_q - kTolerance_q || joints[i] > limits.upper_q + kTolerance_q) {
      throw PositionError(fmt::format("joints: {:.6g} is outside the range of joint {}, {:.6g} to {:.6g}",
                                      value, i, to_shown(kind, limits.lower_q),
                                      to_shown(kind, limits.upper_q)));
    }
    joints[i] = std::clamp(joints[i], limits.lower_q, limits.upper_q);
  }
  return joints;
}

/// Reads the part that does not depend on the profile.
LastPosition read_common(const toml::table& table) {
  LastPosition position;
  position.robot = required<std::string>(table, "robot");
  position.device = required<std::string>(table, "device");
  position.fingerprint = hexadecimal(required<std::string>(table, "profile"));
  position.boot_id = required<std::string>(table, "boot");
  if (position.boot_id.size() > kMaxBootId) throw PositionError("boot: too long");
  position.saved_s = epoch_of(required<toml::date_time>(table, "saved"));
  position.at_rest = required<bool>(table, "at_rest");
  position.held = required<bool>(table, "held");
  position.in_error = required<bool>(table, "in_error");
  if (!table["joints"].is_array()) throw PositionError("joints is missing or of the wrong kind");
  const toml::node* gripper = table.get("gripper");
  if (gripper == nullptr) throw PositionError("gripper is missing");
  position.opening = finite(*gripper, "gripper");
  if (position.opening < 0.0 || position.opening > 1.0) throw PositionError("gripper: allowed 0 to 1");
  return position;
}

toml::table parse(std::string_view text) {
  if (text.size() > kMaxPositionBytes)
    throw PositionError(fmt::format("larger than {} bytes", kMaxPositionBytes));
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw PositionError(fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
}

}  // namespace

std::uint64_t position_fingerprint(const ArmModel& arm) {
  Fnv1a hash;
  hash.add(fingerprint(arm));
  for (const ServoMap& servo : arm.servos) {
    hash.add(std::uint64_t{servo.channel});
    for (const double value :
         {servo.zero_us, servo.us_per_q, servo.direction, servo.pulse_min_us, servo.pulse_max_us})
      hash.add(value);
  }
  hash.add(std::uint64_t{arm.gripper.channel});
  hash.add(arm.gripper.closed_us);
  hash.add(arm.gripper.open_us);
  return hash.value();
}

std::string state_file_stem(std::string_view robot, std::string_view device) {
  return fmt::format("{}{}", robot, device == "loopback" ? ".loopback" : "");
}

std::string utc_text(std::int64_t epoch_s) {
  const std::tm parts = parts_of(epoch_s);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

std::string position_text(const LastPosition& position, const ArmModel& arm) {
  const std::tm when = parts_of(position.saved_s);
  std::string joints;
  for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i) {
    const double value = to_shown(arm.kinematics.joint_kind(i), position.position_q[i]);
    joints += fmt::format("{}{}", joints.empty() ? "" : ", ", value);
  }
  return fmt::format(
      "# The last position that corbot commanded to this arm. Read when the arm is powered up, and only\n"
      "# if its profile has not changed since. Delete it if the arm has been moved by hand: that forgets an "
      "Error, too.\n"
      "format = {}\nrobot = \"{}\"\ndevice = \"{}\"  # kind of [backend]\nprofile = \"{:016x}\"  # "
      "fingerprint\nboot = \"{}\"\n"
      "saved = {:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z\nat_rest = {}\nheld = {}  # by StopAndHold: nothing "
      "moves until Clear\nin_error = {}  # nothing is energised until Clear\njoints = [{}]  # degrees; "
      "metres of joints that slide\n"
      "gripper = {}  # 0 closed, 1 open\n",
      kFormat, position.robot, position.device, position.fingerprint, position.boot_id, when.tm_year + 1900,
      when.tm_mon + 1, when.tm_mday, when.tm_hour, when.tm_min, when.tm_sec, position.at_rest, position.held,
      position.in_error, joints, position.opening);
}

LastPosition parse_position(std::string_view text, std::string_view robot, std::string_view device,
                            const ArmModel& arm) {
  const toml::table table = parse(text);  // a truncated file lacks its gripper, which is at the end
  if (required<std::string>(table, "robot") != robot)
    throw PositionError("the file belongs to another robot");
  try {
    if (required<std::int64_t>(table, "format") != kFormat)
      throw PositionError("this version does not know the format of the file");
    LastPosition position = read_common(table);
    if (position.device != device)
      throw PositionError("the file belongs to another device", position.held, position.in_error);
    if (position.fingerprint != position_fingerprint(arm))
      throw PositionError("the profile has changed since the file was written", position.held,
                          position.in_error);
    position.position_q = read_joints(table, arm);
    return position;
  } catch (const PositionError& error) {
    throw PositionError(error.what(), table["held"].value_exact<bool>().value_or(false), error.in_error());
  }
}

}  // namespace corbot
