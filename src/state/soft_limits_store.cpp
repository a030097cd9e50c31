// SPDX-License-Identifier: Apache-2.0
#include "state/soft_limits_store.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/channel/fingerprint.h"
#include "corbot/units.h"
#include "state/private_file.h"

namespace corbot {
namespace {

constexpr std::int64_t kFormat = 1;
/// Of degrees that were written as text, and no more.
constexpr double kRounding_q = 1e-9;

std::size_t dof_of(const ArmModel& arm) { return std::min<std::size_t>(arm.dof, kMaxJoints); }

std::string fingerprint_text(const ArmModel& arm) { return fmt::format("{:016x}", fingerprint(arm)); }

std::string list(const Joints& values_q, std::size_t dof) {
  std::string text;
  for (std::size_t i = 0; i < dof; ++i)
    text += fmt::format("{}{}", text.empty() ? "" : ", ", values_q[i] / kRadiansPerDegree);
  return text;
}

template <class Value>
Value required(const toml::table& table, std::string_view key) {
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
    const auto value_deg = node.value<double>();
    if (!node.is_number() || !value_deg || !std::isfinite(*value_deg))
      throw SoftLimitsError(fmt::format("{}: not a finite number", key));
    const JointLimits& range = arm.joints[i];
    values[i] = to_radians(*value_deg);
    if (values[i] < range.lower_q - kRounding_q || values[i] > range.upper_q + kRounding_q)
      throw SoftLimitsError(fmt::format("{}: {:.6g} is outside the range of joint {}", key, *value_deg, i));
    values[i] = std::clamp(values[i], range.lower_q, range.upper_q);
  }
  return values;
}

toml::table parse(std::string_view text) {
  if (text.size() > kMaxSoftLimitsBytes)
    throw SoftLimitsError(fmt::format("larger than {} bytes", kMaxSoftLimitsBytes));
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw SoftLimitsError(fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
}

}  // namespace

std::string soft_limits_text(const JointRanges& limits, const std::string& robot, const ArmModel& arm) {
  return fmt::format(
      "# The soft limits that were set for this arm: ranges that its joints keep. Written by "
      "corbot-servant.\n"
      "format = {}\nrobot = \"{}\"\nprofile = \"{}\"  # fingerprint\n"
      "lower_deg = [{}]\nupper_deg = [{}]\n"
      "whole = true  # a file that was cut short lacks this\n",
      kFormat, robot, fingerprint_text(arm), list(limits.lower_q, dof_of(arm)),
      list(limits.upper_q, dof_of(arm)));
}

JointRanges parse_soft_limits(std::string_view text, std::string_view robot, const ArmModel& arm) {
  const toml::table table = parse(text);
  if (required<std::int64_t>(table, "format") != kFormat)
    throw SoftLimitsError("its format is not known to this version");
  if (!required<bool>(table, "whole")) throw SoftLimitsError("whole: must be true");
  if (required<std::string>(table, "robot") != robot) throw SoftLimitsError("it is another robot's");
  if (required<std::string>(table, "profile") != fingerprint_text(arm))
    throw SoftLimitsError("the profile has changed since it was written");
  const JointRanges limits{read_list(table, "lower_deg", arm), read_list(table, "upper_deg", arm)};
  for (std::size_t i = 0; i < dof_of(arm); ++i) {
    if (!(limits.lower_q[i] <= limits.upper_q[i]))
      throw SoftLimitsError(fmt::format("lower_deg is above upper_deg for joint {}", i));
  }
  return limits;
}

SoftLimitsStore::SoftLimitsStore(const std::filesystem::path& directory, std::string robot)
    : file_(directory / (robot + ".limits")),
      fresh_(directory / (robot + ".limits.servant")),
      robot_(std::move(robot)) {
  if (!is_file_name(robot_)) throw std::invalid_argument("'" + robot_ + "' is no name of a robot");
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
    return parse_soft_limits(*text, robot_, arm);
  } catch (const SoftLimitsError& error) {
    throw SoftLimitsError(file_.string() + ": " + error.what());
  }
}

void SoftLimitsStore::save(const std::optional<JointRanges>& limits, const ArmModel& arm) const {
  if (!limits) return remove_private(file_);
  replace_private(file_, fresh_, soft_limits_text(*limits, robot_, arm));
}

}  // namespace corbot
