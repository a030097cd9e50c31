// SPDX-License-Identifier: Apache-2.0
#include "state/soft_limits_store.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "corbot/channel/fingerprint.h"
#include "state/last_position.h"
#include "state/private_file.h"

namespace corbot {
namespace {

constexpr std::int64_t kSoftLimitsFormat = 3;
/// Tolerance for degrees that were written as text, and no more.
constexpr double kRounding_q = 1e-9;

std::size_t dof_of(const ArmModel& arm) { return std::min<std::size_t>(arm.dof, kMaxJoints); }

std::string fingerprint_text(const ArmModel& arm) { return fmt::format("{:016x}", fingerprint(arm)); }

std::string list(const Joints& values_q, const ArmModel& arm) {
  std::string text;
  for (std::size_t i = 0; i < dof_of(arm); ++i)
    text +=
        fmt::format("{}{}", text.empty() ? "" : ", ", to_shown(arm.kinematics.joint_kind(i), values_q[i]));
  return text;
}

template <class Value>
Value required_value(const toml::table& table, std::string_view key) {
  const auto value = table[key].value_exact<Value>();
  if (!value) throw SoftLimitsError(fmt::format("{} is missing or of the wrong kind", key));
  return *value;
}

Joints read_list(const toml::table& table, std::string_view key, const ArmModel& arm) {
  const toml::array* array = table[key].as_array();
  const std::size_t dof = dof_of(arm);
  if (array == nullptr || array->size() != dof)
    throw SoftLimitsError(fmt::format("{}: must be {} numbers", key, dof));
  Joints values{};
  for (std::size_t i = 0; i < dof; ++i) {
    const toml::node& node = *array->get(i);
    const auto value = node.value<double>();
    if (!node.is_number() || !value || !std::isfinite(*value))
      throw SoftLimitsError(fmt::format("{}: not a finite number", key));
    const JointLimits& range = arm.joints[i];
    values[i] = from_shown(arm.kinematics.joint_kind(i), *value);
    if (values[i] < range.lower_q - kRounding_q || values[i] > range.upper_q + kRounding_q)
      throw SoftLimitsError(fmt::format("{}: {:.6g} is outside the range of joint {}", key, *value, i));
    values[i] = std::clamp(values[i], range.lower_q, range.upper_q);
  }
  return values;
}

toml::table parse_soft_limits(std::string_view text) {
  if (text.size() > kMaxSoftLimitsBytes)
    throw SoftLimitsError(fmt::format("larger than {} bytes", kMaxSoftLimitsBytes));
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw SoftLimitsError(fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
}

}  // namespace

std::string soft_limits_text(const JointRanges& limits, const std::string& robot, const std::string& device,
                             const ArmModel& arm) {
  return fmt::format(
      "# The soft limits that were set for this arm: ranges that its joints keep. Written by "
      "corbot-servant.\n"
      "format = {}\nrobot = \"{}\"\ndevice = \"{}\"  # kind of [backend]\nprofile = \"{}\"  # fingerprint\n"
      "lower = [{}]  # degrees; metres of joints that slide\nupper = [{}]\n"
      "whole = true  # a file that was cut short lacks this\n",
      kSoftLimitsFormat, robot, device, fingerprint_text(arm), list(limits.lower_q, arm),
      list(limits.upper_q, arm));
}

JointRanges parse_soft_limits(std::string_view text, std::string_view robot, std::string_view device,
                              const ArmModel& arm) {
  const toml::table table = parse_soft_limits(text);
  if (required_value<std::int64_t>(table, "format") != kSoftLimitsFormat)
    throw SoftLimitsError("this version does not know the format of the file");
  if (!required_value<bool>(table, "whole")) throw SoftLimitsError("whole: must be true");
  if (required_value<std::string>(table, "robot") != robot)
    throw SoftLimitsError("the file belongs to another robot");
  if (required_value<std::string>(table, "device") != device)
    throw SoftLimitsError("the file belongs to another device");
  if (required_value<std::string>(table, "profile") != fingerprint_text(arm))
    throw SoftLimitsError("the profile has changed since the file was written");
  const JointRanges limits{read_list(table, "lower", arm), read_list(table, "upper", arm)};
  for (std::size_t i = 0; i < dof_of(arm); ++i) {
    if (!(limits.lower_q[i] <= limits.upper_q[i]))
      throw SoftLimitsError(fmt::format("lower is above upper for joint {}", i));
  }
  return limits;
}

SoftLimitsStore::SoftLimitsStore(const std::filesystem::path& directory, std::string robot,
                                 std::string device)
    : file_(directory / (state_file_stem(robot, device) + ".limits")),
      fresh_(file_.string() + ".servant"),
      robot_(std::move(robot)),
      device_(std::move(device)) {
  if (!is_file_name(robot_)) throw std::invalid_argument("'" + robot_ + "' is not the name of a robot");
}

std::optional<JointRanges> SoftLimitsStore::load(const ArmModel& arm) const {
  std::optional<std::string> text;
  try {
    text = read_private(file_, kMaxSoftLimitsBytes);
  } catch (const std::runtime_error& error) {
    throw SoftLimitsError(error.what());
  }
  if (!text) return std::nullopt;
  try {
    return parse_soft_limits(*text, robot_, device_, arm);
  } catch (const SoftLimitsError& error) {
    throw SoftLimitsError(file_.string() + ": " + error.what());
  }
}

void SoftLimitsStore::save(const std::optional<JointRanges>& limits, const ArmModel& arm) const {
  if (!limits) return remove_private(file_);
  replace_private(file_, fresh_, soft_limits_text(*limits, robot_, device_, arm));
}

}  // namespace corbot
