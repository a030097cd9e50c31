// SPDX-License-Identifier: Apache-2.0
#include "robot/settings.h"

namespace corbot {
namespace {

void inherit_value(double& own, double former, double initial) {
  if (own == initial) own = former;
}

}  // namespace

PlanSettings Settings::get() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

void Settings::inherit(const PlanSettings& former) {
  const PlanSettings initial;
  const std::lock_guard lock(mutex_);
  inherit_value(settings_.speed_ratio, former.speed_ratio, initial.speed_ratio);
  for (std::size_t i = 0; i < settings_.joint_speed_ratio.size(); ++i) {
    inherit_value(settings_.joint_speed_ratio[i], former.joint_speed_ratio[i], initial.joint_speed_ratio[i]);
  }
  if (!settings_.tool_pitch_rad && !settings_.tool_orientation) {
    settings_.tool_pitch_rad = former.tool_pitch_rad;
    settings_.tool_orientation = former.tool_orientation;
  }
  if (!settings_.tool_frame) settings_.tool_frame = former.tool_frame;
  if (!settings_.base_frame) settings_.base_frame = former.base_frame;
  keep();
}

void Settings::keep() { kept_.store(to_record(settings_)); }

SettingsRecord to_record(const PlanSettings& settings) {
  SettingsRecord record{};
  record.speed_ratio = settings.speed_ratio;
  record.joint_speed_ratio = settings.joint_speed_ratio;
  SettingsTool set = SettingsTool::kNot;
  if (settings.tool_pitch_rad) set = SettingsTool::kPitch;
  if (settings.tool_orientation) set = SettingsTool::kOrientation;
  record.tool_is_set = static_cast<std::uint64_t>(set);
  record.tool_pitch_rad = settings.tool_pitch_rad.value_or(0.0);
  record.tool_orientation = settings.tool_orientation.value_or(Quaternion{});
  record.frames_set =
      (settings.tool_frame ? kSettingsToolFrame : 0) | (settings.base_frame ? kSettingsBaseFrame : 0);
  if (settings.tool_frame) record.tool_frame = *settings.tool_frame;
  if (settings.base_frame) record.base_frame = *settings.base_frame;
  return record;
}

PlanSettings to_settings(const SettingsRecord& record) {
  PlanSettings settings;
  settings.speed_ratio = record.speed_ratio;
  settings.joint_speed_ratio = record.joint_speed_ratio;
  const auto set = static_cast<SettingsTool>(record.tool_is_set);
  if (set == SettingsTool::kPitch) settings.tool_pitch_rad = record.tool_pitch_rad;
  if (set == SettingsTool::kOrientation) settings.tool_orientation = record.tool_orientation;
  if ((record.frames_set & kSettingsToolFrame) != 0) settings.tool_frame = record.tool_frame;
  if ((record.frames_set & kSettingsBaseFrame) != 0) settings.base_frame = record.base_frame;
  return settings;
}

}  // namespace corbot
