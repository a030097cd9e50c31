// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: settings. Converts units and exceptions. No exception leaves this
// file.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "robot/recorded_call.h"

namespace {
using namespace corbot;
}

corbot_status corbot_robot_set_override(corbot_robot* robot, const corbot_caller* caller, double percent,
                                        corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted& wanted) { of.set_override(percent, wanted); },
      "Override({})", percent);
}

corbot_status corbot_robot_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                 corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_speed(percent); }, "Speed({})", percent);
}

corbot_status corbot_robot_art_speed(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                     double percent, corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_joint_speed(joint, percent); },
      "ArtSpeed({}, {})", joint, percent);
}

corbot_status corbot_robot_all_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                     corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_all_speeds(percent); }, "AllSpeed({})",
      percent);
}

corbot_status corbot_robot_set_tool_pitch(corbot_robot* robot, const corbot_caller* caller, double degrees,
                                          corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_tool_pitch(degrees); }, "SetToolPitch({})",
      degrees);
}

corbot_status corbot_robot_set_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                const double orientation[4], corbot_error* error) {
  const Quaternion wanted{orientation[0], orientation[1], orientation[2], orientation[3]};
  return change(
      robot, caller, error, [&](Robot& of, const Wanted&) { of.set_tool_orientation(wanted); },
      "SetToolOrientation({}, {}, {}, {})", wanted.w, wanted.x, wanted.y, wanted.z);
}

corbot_status corbot_robot_reset_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                  corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted&) { of.reset_tool_orientation(); },
      "ResetToolOrientation()");
}

corbot_status corbot_robot_set_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                           const corbot_joint_ranges* limits, size_t count,
                                           corbot_error* error) {
  std::string ranges;
  guarded(nullptr, [&] {
    for (std::size_t i = 0; i < std::min<std::size_t>(count, CORBOT_MAX_JOINTS); ++i) {
      ranges += fmt::format("{}{} {}", i > 0 ? ", " : "", limits->lower[i], limits->upper[i]);
    }
  });
  return change(
      robot, caller, error,
      [&](Robot& of, const Wanted&) {
        const std::size_t dof = of.profile().arm.dof;
        if (count != dof) {
          throw bad_argument("limits", static_cast<double>(count),
                             fmt::format("{} ranges, but the arm has {} joints", count, dof));
        }
        JointRanges wanted;
        std::copy_n(limits->lower, dof, wanted.lower_q.begin());
        std::copy_n(limits->upper, dof, wanted.upper_q.begin());
        of.set_soft_limits(wanted);
      },
      "SetSoftLimits([{}])", ranges);
}

corbot_status corbot_robot_reset_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                             corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted&) { of.reset_soft_limits(); }, "ResetSoftLimits()");
}
