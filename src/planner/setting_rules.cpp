// SPDX-License-Identifier: Apache-2.0
#include "planner/setting_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "corbot/arm/joint_units.h"
#include "corbot/interface_words.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

constexpr double kShownAndBack_q = 1e-9;  // rounding error of the conversion to shown units and back

/// Returns the refusal of a tool pitch: says what the arm's tool has instead.
const char* pitch_refused(const Kinematics& arm) {
  switch (arm.follows()) {
    case Follows::kFull:
      return "this arm has no tool pitch: set the orientation of its tool";
    case Follows::kYaw:
      return "this arm has no tool pitch: it follows the yaw of its tool alone, which its motions keep";
    default:
      return arm.followed().count > 0
                 ? "this arm has no tool pitch: its motions keep what it follows of its tool's orientation"
                 : "this arm has no tool pitch: the orientation of its tool is what its position gives";
  }
}

/// Returns the refusal of an orientation: says what an arm of fewer than six joints follows instead.
const char* orientation_refused(const Kinematics& arm) {
  switch (arm.follows()) {
    case Follows::kPitch:
      return "this arm follows the tool pitch alone, no other orientation: set the tool pitch, or move to a "
             "pose that the arm can take";
    case Follows::kPitchAndRoll:
      return "this arm follows pitch and roll of its tool, not every orientation: set the tool pitch, or "
             "move to a pose that the arm can take";
    case Follows::kYaw:
      return "this arm follows the yaw of its tool alone, no other orientation, and its motions keep the "
             "yaw: "
             "move to a pose that the arm can take";
    case Follows::kNone:
      if (arm.followed().count > 0)
        return "this arm does not follow every orientation, and its motions keep what it follows: move to a "
               "pose that the arm can take";
      break;
    case Follows::kFull:
      break;
  }
  return "this arm follows no orientation: that of its tool is what its position gives";
}

/// The numbers have the interface's units already, not radians.
PlanRefusal bad_setting(const std::string& parameter, double value, const std::string& text) {
  return bad_parameter(parameter, Quantity::kNumber, value, 0.0, 0.0, text);
}

/// Returns text like "-0.15 to 0 m".
std::string shown_range(JointKind kind, double lower_q, double upper_q) {
  return fmt::format("{:.6g} to {}", to_shown(kind, lower_q), shown_joint(kind, upper_q));
}

PlanRefusal outside(const std::string& parameter, std::size_t joint, double value_q, double lower_q,
                    double upper_q, const std::string& text) {
  PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, parameter, Quantity::kJointValue);
  refusal.joint = static_cast<int>(joint);
  refusal.value = value_q;
  refusal.lower = lower_q;
  refusal.upper = upper_q;
  refusal.text = text;
  return refusal;
}

/// Checks that both limits are finite, in order and within the profile's range.
std::optional<PlanRefusal> check_limits(const ArmModel& arm, std::size_t joint, double lower, double upper) {
  const JointLimits& range = arm.joints[joint];
  const JointKind kind = arm.kinematics.joint_kind(joint);
  for (const double value : {lower, upper}) {
    if (!std::isfinite(value))
      return bad_setting("limits", value, fmt::format("a limit of joint {} is not a finite number", joint));
  }
  if (lower > upper) {
    return bad_setting("limits", lower,
                       fmt::format("joint {}: the lower limit {:.6g} {} is above the upper one, {:.6g} {}",
                                   joint, lower, unit_name(kind), upper, unit_name(kind)));
  }
  for (const double value : {lower, upper}) {
    const double value_q = from_shown(kind, value);
    if (value_q >= range.lower_q - kShownAndBack_q && value_q <= range.upper_q + kShownAndBack_q) continue;
    return outside(kJointRangeWord, joint, value_q, range.lower_q, range.upper_q,
                   fmt::format("joint {}: the limit {:.6g} {} is outside the range of the profile, {}", joint,
                               value, unit_name(kind), shown_range(kind, range.lower_q, range.upper_q)));
  }
  return std::nullopt;
}

}  // namespace

std::optional<PlanRefusal> check_joint_number(const ArmModel& arm, int joint) {
  if (joint >= 0 && static_cast<std::size_t>(joint) < arm.dof) return std::nullopt;
  // The interface uses this name of the parameter.
  return bad_setting("articulation", joint, fmt::format("joint {}, allowed 0 to {}", joint, arm.dof - 1));
}

std::optional<PlanRefusal> check_tool_pitch(const Kinematics& arm, double degrees) {
  if (!(degrees >= -180.0 && degrees <= 180.0))
    return bad_setting("degrees", degrees,
                       fmt::format("tool pitch {:.6g} degrees, allowed -180 to 180", degrees));
  if (!has_tool_pitch(arm)) return bad_setting("degrees", degrees, pitch_refused(arm));
  return std::nullopt;
}

void take_tool_pitch(PlanSettings& settings, double degrees) {
  settings.tool_pitch_rad = to_radians(degrees);
  settings.tool_orientation.reset();
}

std::optional<PlanRefusal> check_tool_orientation(const ArmModel& arm, const Quaternion& orientation) {
  if (arm.kinematics.follows() != Follows::kFull)
    return bad_setting("orientation", static_cast<double>(arm.dof), orientation_refused(arm.kinematics));
  return check_orientation(orientation, "orientation", "orientation");
}

void take_tool_orientation(PlanSettings& settings, const Quaternion& orientation) {
  const Quaternion unit = normalised(orientation);
  settings.tool_pitch_rad.reset();
  settings.tool_orientation = unit.w < 0.0 ? Quaternion{-unit.w, -unit.x, -unit.y, -unit.z} : unit;
}

void take_any_orientation(PlanSettings& settings) {
  settings.tool_pitch_rad.reset();
  settings.tool_orientation.reset();
}

void take_tool_frame(PlanSettings& settings, const Pose& flange_T_tool) {
  settings.tool_frame = Pose{flange_T_tool.position_m, normalised(flange_T_tool.orientation)};
}

void take_base_frame(PlanSettings& settings, const Pose& world_T_base) {
  settings.base_frame = Pose{world_T_base.position_m, normalised(world_T_base.orientation)};
}

void take_profile_frames(PlanSettings& settings) {
  settings.tool_frame.reset();
  settings.base_frame.reset();
}

JointRanges profile_ranges(const ArmModel& arm) {
  JointRanges ranges;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    ranges.lower_q[i] = arm.joints[i].lower_q;
    ranges.upper_q[i] = arm.joints[i].upper_q;
  }
  return ranges;
}

std::variant<JointRanges, PlanRefusal> soft_limits_of(const ArmModel& arm, const JointRanges& shown) {
  JointRanges limits;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    if (auto refusal = check_limits(arm, i, shown.lower_q[i], shown.upper_q[i])) return *refusal;
    const JointLimits& range = arm.joints[i];
    const JointKind kind = arm.kinematics.joint_kind(i);
    limits.lower_q[i] = std::clamp(from_shown(kind, shown.lower_q[i]), range.lower_q, range.upper_q);
    limits.upper_q[i] = std::clamp(from_shown(kind, shown.upper_q[i]), range.lower_q, range.upper_q);
  }
  return limits;
}

std::optional<PlanRefusal> check_stands_within(const ArmModel& arm, const JointRanges& limits,
                                               const Joints& position_q) {
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const double lower_q = limits.lower_q[i], upper_q = limits.upper_q[i], there_q = position_q[i];
    if (there_q >= lower_q - kShownAndBack_q && there_q <= upper_q + kShownAndBack_q) continue;
    const JointKind kind = arm.kinematics.joint_kind(i);
    return outside("joint position", i, there_q, lower_q, upper_q,
                   fmt::format("joint {} stands at {}, outside the wanted limits, {}", i,
                               shown_joint(kind, there_q), shown_range(kind, lower_q, upper_q)));
  }
  return std::nullopt;
}

}  // namespace corbot
