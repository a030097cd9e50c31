// SPDX-License-Identifier: Apache-2.0
#include "state/soft_limits_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "corbot/arm/joint_units.h"
#include "state/setting_text.h"

namespace corbot {
namespace {

constexpr std::int64_t kSoftLimitsFormat = 3;
/// Tolerance for degrees that were written as text, and no more.
constexpr double kRounding_q = 1e-9;

std::size_t dof_of(const ArmModel& arm) { return std::min<std::size_t>(arm.dof, kMaxJoints); }

std::string list(const Joints& values_q, const ArmModel& arm) {
  std::string text;
  for (std::size_t i = 0; i < dof_of(arm); ++i)
    text +=
        fmt::format("{}{}", text.empty() ? "" : ", ", to_shown(arm.kinematics.joint_kind(i), values_q[i]));
  return text;
}

Joints read_list(const toml::table& table, std::string_view key, const ArmModel& arm) {
  const toml::array* array = table[key].as_array();
  const std::size_t dof = dof_of(arm);
  if (array == nullptr || array->size() != dof)
    throw SettingError(fmt::format("{}: must be {} numbers", key, dof));
  Joints values{};
  for (std::size_t i = 0; i < dof; ++i) {
    const toml::node& node = *array->get(i);
    const auto value = node.value<double>();
    if (!node.is_number() || !value || !std::isfinite(*value))
      throw SettingError(fmt::format("{}: not a finite number", key));
    const JointLimits& range = arm.joints[i];
    values[i] = from_shown(arm.kinematics.joint_kind(i), *value);
    if (values[i] < range.lower_q - kRounding_q || values[i] > range.upper_q + kRounding_q)
      throw SettingError(fmt::format("{}: {:.6g} is outside the range of joint {}", key, *value, i));
    values[i] = std::clamp(values[i], range.lower_q, range.upper_q);
  }
  return values;
}

}  // namespace

std::string SoftLimitsText::write(const JointRanges& limits, const SettingOwner& owner, const ArmModel& arm) {
  return setting_head("The soft limits that were set for this arm: ranges that its joints keep.",
                      kSoftLimitsFormat, owner, arm) +
         fmt::format("lower = [{}]  # degrees; metres of joints that slide\nupper = [{}]\n",
                     list(limits.lower_q, arm), list(limits.upper_q, arm)) +
         kSettingEnd;
}

JointRanges SoftLimitsText::read(std::string_view text, const SettingOwner& owner, const ArmModel& arm) {
  const toml::table table = read_setting(text, kMostBytes, kSoftLimitsFormat, owner, arm);
  const JointRanges limits{read_list(table, "lower", arm), read_list(table, "upper", arm)};
  for (std::size_t i = 0; i < dof_of(arm); ++i) {
    if (!(limits.lower_q[i] <= limits.upper_q[i]))
      throw SettingError(fmt::format("lower is above upper for joint {}", i));
  }
  return limits;
}

}  // namespace corbot
