// SPDX-License-Identifier: Apache-2.0
#include "state/setting_text.h"

#include "corbot/channel/fingerprint.h"

namespace corbot {
namespace {

std::string fingerprint_text(const ArmModel& arm) { return fmt::format("{:016x}", fingerprint(arm)); }

toml::table parse(std::string_view text, std::size_t most_bytes) {
  if (text.size() > most_bytes) throw SettingError(fmt::format("larger than {} bytes", most_bytes));
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw SettingError(fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
}

}  // namespace

std::string setting_head(const std::string& about, std::int64_t format, const SettingOwner& owner,
                         const ArmModel& arm) {
  return fmt::format(
      "# {} Written by corbot-servant.\n"
      "format = {}\nrobot = \"{}\"\ndevice = \"{}\"  # kind of [backend]\nprofile = \"{}\"  # fingerprint\n",
      about, format, owner.robot, owner.device, fingerprint_text(arm));
}

toml::table read_setting(std::string_view text, std::size_t most_bytes, std::int64_t format,
                         const SettingOwner& owner, const ArmModel& arm) {
  toml::table table = parse(text, most_bytes);
  if (required_value<std::int64_t>(table, "format") != format)
    throw SettingError("this version does not know the format of the file");
  if (!required_value<bool>(table, "whole")) throw SettingError("whole: must be true");
  if (required_value<std::string>(table, "robot") != owner.robot)
    throw SettingError("the file belongs to another robot");
  if (required_value<std::string>(table, "device") != owner.device)
    throw SettingError("the file belongs to another device");
  if (required_value<std::string>(table, "profile") != fingerprint_text(arm))
    throw SettingError("the profile has changed since the file was written");
  return table;
}

}  // namespace corbot
