// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <toml++/toml.h>
#include <cstdint>
#include <string>
#include <string_view>

#include "corbot/arm/arm_model.h"
#include "state/setting_store.h"

// The texts of all settings have this in common. For the sources of this room only.

namespace corbot {

/// Returns the lines before the value. `about` is a comment.
[[nodiscard]] std::string setting_head(const std::string& about, std::int64_t format,
                                       const SettingOwner& owner, const ArmModel& arm);
/// The last line.
inline constexpr const char* kSettingEnd = "whole = true  # a file that was cut short lacks this\n";

/// Parses a text and checks all lines but the value. Throws SettingError unless the text is whole, and of
/// this robot, this device and this model of its arm.
[[nodiscard]] toml::table read_setting(std::string_view text, std::size_t most_bytes, std::int64_t format,
                                       const SettingOwner& owner, const ArmModel& arm);

template <class Value>
Value required_value(const toml::table& table, std::string_view key) {
  const auto value = table[key].value_exact<Value>();
  if (!value) throw SettingError(fmt::format("{} is missing or of the wrong kind", key));
  return *value;
}

}  // namespace corbot
