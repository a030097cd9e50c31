// SPDX-License-Identifier: Apache-2.0
// Sets the tool frame and the base frame at run time, and applies them to poses.
#include "planner/setting_rules.h"
#include "robot/robot.h"

namespace corbot {

void Robot::set_tool_frame(const Pose& flange_T_tool) {
  check_setting(check_tool_frame(profile_.arm.kinematics, flange_T_tool));
  settings_.change([&](PlanSettings& now) { take_tool_frame(now, flange_T_tool); });
}

void Robot::set_base_frame(const Pose& world_T_base) {
  check_setting(check_base_frame(world_T_base));
  settings_.change([&](PlanSettings& now) { take_base_frame(now, world_T_base); });
}

void Robot::reset_frames() { settings_.change(take_profile_frames); }

Frames Robot::frames() const { return frames_in_force(profile_.arm.kinematics, settings_.get()); }

std::vector<PoseSolution> Robot::solutions(const Pose& pose) const {
  const PlanSettings now = settings_in_force();
  Joints hint_q{};
  if (Snapshot newest{}; link_.snapshot(newest)) hint_q = newest.position_q;
  auto found = solutions_at(profile_.arm, now, pose, hint_q);
  if (const auto* refusal = std::get_if<PlanRefusal>(&found))
    throw refused(*refusal, profile_.arm.kinematics);
  return std::get<std::vector<PoseSolution>>(std::move(found));
}

std::optional<std::uint32_t> Robot::solution() const {
  return solution_in_use(profile_.arm, settings_.get(), view_.snapshot().position_q);
}

}  // namespace corbot
