// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: motions to a pose and by an offset. No exception leaves this file.
#include <fmt/format.h>

#include "robot/recorded_call.h"

namespace {

using namespace corbot;

Pose pose(const corbot_tool_pose& from) {
  const double* const p_m = from.position_m;
  const double* const q = from.orientation;
  return {{p_m[0], p_m[1], p_m[2]}, {q[0], q[1], q[2], q[3]}};
}

corbot_status move_pose(corbot_robot* robot, const corbot_caller* caller, const char* name,
                        const corbot_tool_pose& target, double t_s, bool straight, corbot_ticket* ticket,
                        corbot_error* error) {
  const double* const p_m = target.position_m;
  const double* const q = target.orientation;
  return start(
      robot, caller, ticket, error,
      [&] {
        return MovePoseRequest{pose(target), t_s, straight};
      },
      "{}({}, {}, {}, {}, {}, {}, {}, {})", name, p_m[0], p_m[1], p_m[2], q[0], q[1], q[2], q[3], t_s);
}

const char* name_of(int32_t frame) {
  switch (frame) {
    case CORBOT_OFFSET_IN_BASE:
      return "OffsetInBase";
    case CORBOT_OFFSET_IN_TOOL:
      return "OffsetInTool";
    default:
      return "unknown frame";
  }
}

corbot_status move_relative(corbot_robot* robot, const corbot_caller* caller, const char* name,
                            const corbot_tool_pose& offset, int32_t frame, double t_s, bool straight,
                            corbot_ticket* ticket, corbot_error* error) {
  const double* const p_m = offset.position_m;
  const double* const q = offset.orientation;
  return start(
      robot, caller, ticket, error,
      [&] {
        return MoveRelativeRequest{pose(offset), static_cast<OffsetFrame>(frame), t_s, straight};
      },
      "{}({}, {}, {}, {}, {}, {}, {}, {}, {})", name, p_m[0], p_m[1], p_m[2], q[0], q[1], q[2], q[3],
      name_of(frame), t_s);
}

}  // namespace

corbot_status corbot_robot_move_pose(corbot_robot* robot, const corbot_caller* caller,
                                     const corbot_tool_pose* target, double t_s, corbot_ticket* ticket,
                                     corbot_error* error) {
  return move_pose(robot, caller, "MovePose", *target, t_s, false, ticket, error);
}

corbot_status corbot_robot_move_pose_s(corbot_robot* robot, const corbot_caller* caller,
                                       const corbot_tool_pose* target, double t_s, corbot_ticket* ticket,
                                       corbot_error* error) {
  return move_pose(robot, caller, "MovePoseS", *target, t_s, true, ticket, error);
}

corbot_status corbot_robot_move_relative(corbot_robot* robot, const corbot_caller* caller,
                                         const corbot_tool_pose* offset, int32_t frame, double t_s,
                                         corbot_ticket* ticket, corbot_error* error) {
  return move_relative(robot, caller, "MoveRelative", *offset, frame, t_s, false, ticket, error);
}

corbot_status corbot_robot_move_relative_s(corbot_robot* robot, const corbot_caller* caller,
                                           const corbot_tool_pose* offset, int32_t frame, double t_s,
                                           corbot_ticket* ticket, corbot_error* error) {
  return move_relative(robot, caller, "MoveRelativeS", *offset, frame, t_s, true, ticket, error);
}
