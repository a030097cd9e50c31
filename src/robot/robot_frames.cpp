// SPDX-License-Identifier: Apache-2.0
// Tool frame and base frame at run time, and what they make of a pose.
#include "robot/robot.h"

namespace corbot {
namespace {

Pose of_unit_length(const Pose& frame) { return {frame.position_m, normalised(frame.orientation)}; }

}  // namespace

void Robot::set_tool_frame(const Pose& flange_T_tool) {
  if (const auto refusal = check_tool_frame(profile_.arm.kinematics, flange_T_tool))
    throw refused(*refusal, profile_.arm.kinematics);
  settings_.change([tool = of_unit_length(flange_T_tool)](PlanSettings& now) { now.tool_frame = tool; });
}

void Robot::set_base_frame(const Pose& world_T_base) {
  if (const auto refusal = check_base_frame(world_T_base)) throw refused(*refusal, profile_.arm.kinematics);
  settings_.change([base = of_unit_length(world_T_base)](PlanSettings& now) { now.base_frame = base; });
}

void Robot::reset_frames() {
  settings_.change([](PlanSettings& now) {
    now.tool_frame.reset();
    now.base_frame.reset();
  });
}

Frames Robot::frames() const { return frames_in_force(profile_.arm.kinematics, settings_.get()); }

std::vector<PoseSolution> Robot::solutions(const Pose& pose) const {
  PlanSettings now = settings_.get();
  now.soft_limits = limits_.wanted();
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
