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
  inherit_value(settings_.tool_pitch_rad, former.tool_pitch_rad, initial.tool_pitch_rad);
  keep();
}

void Settings::keep() {
  kept_.store({settings_.speed_ratio, settings_.joint_speed_ratio, settings_.tool_pitch_rad});
}

}  // namespace corbot
