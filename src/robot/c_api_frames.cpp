// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: frames and solutions. Converts units and exceptions. No exception
// leaves this file.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "corbot/arm/joint_units.h"
#include "robot/recorded_call.h"

namespace {
using namespace corbot;

Pose frame_of(const corbot_tool_pose& from) {
  const double* const p = from.position_m;
  const double* const q = from.orientation;
  return {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}};
}

/// Returns the frame with w of the quaternion not negative and without a negative zero.
corbot_tool_pose shown(const Pose& frame) {
  Quaternion q = normalised(frame.orientation);
  if (q.w < 0.0) q = {-q.w, -q.x, -q.y, -q.z};
  const auto& p = frame.position_m;
  return {{p[0] + 0.0, p[1] + 0.0, p[2] + 0.0}, {q.w, q.x + 0.0, q.y + 0.0, q.z + 0.0}};
}

/// Returns the pose as text, in the order of the IDL: Pose{Point, Quaternion}.
std::string text_of(const corbot_tool_pose& pose) {
  const double* const p = pose.position_m;
  const double* const q = pose.orientation;
  std::string text;
  guarded(nullptr,
          [&] { text = fmt::format("[{} {} {}] [{} {} {} {}]", p[0], p[1], p[2], q[0], q[1], q[2], q[3]); });
  return text;
}

}  // namespace

corbot_status corbot_robot_set_tool_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* flange_T_tool, corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_tool_frame(frame_of(*flange_T_tool)); },
      "SetToolFrame({})", text_of(*flange_T_tool));
}

corbot_status corbot_robot_set_base_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* world_T_base, corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_base_frame(frame_of(*world_T_base)); },
      "SetBaseFrame({})", text_of(*world_T_base));
}

corbot_status corbot_robot_reset_frames(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted&) { of.reset_frames(); }, "ResetFrames()");
}

void corbot_robot_frames(const corbot_robot* robot, corbot_tool_pose* flange_T_tool,
                         corbot_tool_pose* world_T_base) {
  guarded(nullptr, [&] {
    const Frames frames = robot->robot.frames();
    *flange_T_tool = shown(frames.n_T_tool);
    *world_T_base = shown(frames.base_T_0);
  });
}

corbot_status corbot_robot_solutions(const corbot_robot* robot, const corbot_tool_pose* target,
                                     corbot_pose_solution out[CORBOT_MAX_SOLUTIONS], size_t* count,
                                     corbot_error* error) {
  *count = 0;
  return guarded(error, [&] {
    static_assert(CORBOT_MAX_SOLUTIONS == kMaxSolutions);
    const Kinematics& arm = robot->robot.profile().arm.kinematics;
    for (const PoseSolution& solution : robot->robot.solutions(frame_of(*target))) {
      corbot_pose_solution& to = out[(*count)++];
      to = corbot_pose_solution{};
      to.number = solution.number;
      to.in_range = solution.in_range ? 1 : 0;
      to.orientation_error_deg = to_degrees(solution.orientation_error_rad);
      for (std::size_t i = 0; i < arm.joint_count(); ++i) {
        const double q = solution.joints_q[i];
        to.joints[i] = to_shown(arm.joint_kind(i), q);
      }
    }
  });
}

corbot_status corbot_robot_solution(const corbot_robot* robot, int32_t* number, corbot_error* error) {
  return guarded(error, [&] {
    const auto in_use = robot->robot.solution();
    *number = in_use ? static_cast<int32_t>(*in_use) : -1;
  });
}
