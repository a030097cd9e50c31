// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/dry_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <variant>
#include <vector>

#include "client/client.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "corbot/arm/joint_units.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/units.h"
#include "planner/frame_settings.h"
#include "planner/plan/refusal.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::Request;
using client::Verb;

namespace {

Profile profile_of(const std::string& file) {
  try {
    return load_profile(file);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

std::array<double, 3> point(const Request& request, std::size_t first) {
  return {request.numbers[first], request.numbers[first + 1], request.numbers[first + 2]};
}

/// P, and D above it.
std::array<double, 3> point_above(const Request& request) {
  std::array<double, 3> above = point(request, 0);
  above[2] += request.above_m;
  return above;
}

Quaternion orientation(std::span<const double> numbers) {
  const Corbot::Quaternion q = client::orientation_of(numbers);
  return {q.w, q.x, q.y, q.z};
}

/// X Y Z, and an orientation where one is given.
Pose pose(const Request& request) {
  return {point(request, 0), orientation(std::span(request.numbers).subspan(3))};
}

MotionRequest drive(const Request& request, const ArmModel& arm) {
  const auto joint = static_cast<std::size_t>(request.numbers[0]);
  const JointKind kind = joint < arm.dof ? arm.kinematics.joint_kind(joint) : JointKind::kRotary;
  return DriveRequest{static_cast<int>(joint), from_shown(kind, request.numbers[1]),
                      from_shown(kind, request.numbers[2])};
}

MotionRequest joints(const Request& request, const ArmModel& arm) {
  MoveJointsRequest move{{}, request.time_s};
  for (std::size_t i = 0; i < request.numbers.size(); ++i)
    move.target_q[i] = from_shown(arm.kinematics.joint_kind(i), request.numbers[i]);
  return move;
}

MotionRequest motion(const Request& request, const ArmModel& arm) {
  const OffsetFrame frame = request.tool ? OffsetFrame::kTool : OffsetFrame::kBase;
  switch (request.verb) {
    case Verb::kMove:
      return MoveRequest{point_above(request), request.time_s};
    case Verb::kMoveS:
      return MoveSRequest{point_above(request), request.time_s};
    case Verb::kMoveC:
      return MoveCRequest{point(request, 0), point(request, 3), point(request, 6)};
    case Verb::kDrive:
      return drive(request, arm);
    case Verb::kJoints:
      return joints(request, arm);
    case Verb::kReady:
      return ReadyRequest{};
    case Verb::kDelay:
      return DwellRequest{request.numbers[0]};
    case Verb::kOpen:
      return GripperRequest{1.0};
    case Verb::kClose:
      return GripperRequest{0.0};
    case Verb::kGripper:
      return GripperRequest{request.numbers[0] / 100.0};
    case Verb::kMovePose:
      return MovePoseRequest{pose(request), request.time_s, request.line};
    case Verb::kMoveRelative:
      return MoveRelativeRequest{pose(request), frame, request.time_s, request.line};
    default:
      throw Failure(ExitCode::kInternal, "not a motion: " + to_string(request));
  }
}

std::string no_such_joint(std::size_t joint, const ArmModel& arm) {
  return fmt::format("joint {}, allowed 0 to {}", joint, arm.dof - 1);
}

JointRanges ranges_of(const ArmModel& arm) {
  JointRanges ranges;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    ranges.lower_q[i] = arm.joints[i].lower_q;
    ranges.upper_q[i] = arm.joints[i].upper_q;
  }
  return ranges;
}

}  // namespace

DryRun::DryRun(const std::string& profile) : profile_(profile_of(profile)), planner_(profile_.arm) {}

std::optional<std::string> DryRun::refusal_of(const Request& given) {
  try {
    const Request request = client::with_joint_number(given, profile_.joint_names);
    return client::spec_of(request.verb).motion ? move(request) : set(request);
  } catch (const Failure& failure) {
    return failure.what();
  }
}

std::optional<std::string> DryRun::move(const Request& request) {
  const ArmModel& arm = profile_.arm;
  if (request.verb == Verb::kJoints && request.numbers.size() != arm.dof)
    return fmt::format("{} values, but the arm has {} joints", request.numbers.size(), arm.dof);
  const PlanResult plan = planner_.plan(start_, settings_, motion(request, arm));
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) return refusal->text;
  for (const Command& command : std::get<std::vector<Command>>(plan)) {
    start_.position_q = command.end_q;
    if (command.kind == MotionKind::kGripper)
      start_.gripper = command.gripper.from + command.gripper.law.distance;
  }
  return std::nullopt;
}

std::optional<std::string> DryRun::set(const Request& request) {
  switch (request.verb) {
    case Verb::kSpeed:
      return set_speed(request);
    case Verb::kPitch:
    case Verb::kOrientation:
      return set_orientation(request);
    case Verb::kLimit:
      return set_limit(request);
    case Verb::kTool:
    case Verb::kBase:
    case Verb::kFrames:
      return set_frame(request);
    default:
      return std::nullopt;  // an override, which the plan does not depend on
  }
}

std::optional<std::string> DryRun::set_speed(const Request& request) {
  const double ratio = request.numbers[0] / 100.0;
  const auto joint = static_cast<std::size_t>(request.joint);
  if (request.joint >= 0 && joint >= profile_.arm.dof) return no_such_joint(joint, profile_.arm);
  if (request.joint >= 0) {
    settings_.joint_speed_ratio[joint] = ratio;
  } else if (request.all) {
    settings_.joint_speed_ratio.fill(ratio);
  } else {
    settings_.speed_ratio = ratio;
  }
  return std::nullopt;
}

std::optional<std::string> DryRun::set_orientation(const Request& request) {
  const Kinematics& arm = profile_.arm.kinematics;
  const bool is_pitch = request.verb == Verb::kPitch;
  std::optional<Quaternion> wanted;
  if (is_pitch) {
    const double degrees = request.numbers[0];
    if (!(degrees >= -180.0 && degrees <= 180.0))
      return fmt::format("{:.6g} degrees, allowed -180 to 180", degrees);
    if (!has_tool_pitch(arm)) return "the arm has no tool pitch";
  } else if (!request.reset) {
    if (arm.follows() != Follows::kFull) return "the arm cannot take every orientation";
    wanted = orientation(request.numbers);
    if (const auto refusal = check_orientation(*wanted, "orientation", "orientation")) return refusal->text;
    wanted = normalised(*wanted);
  }
  settings_.tool_pitch_rad = is_pitch ? std::optional(to_radians(request.numbers[0])) : std::nullopt;
  settings_.tool_orientation = wanted;
  return std::nullopt;
}

std::optional<std::string> DryRun::set_limit(const Request& request) {
  if (request.reset) {
    settings_.soft_limits.reset();
    return std::nullopt;
  }
  constexpr double kRounding_q = 1e-9;  // of degrees and back
  const ArmModel& arm = profile_.arm;
  const auto joint = static_cast<std::size_t>(request.numbers[0]);
  if (joint >= arm.dof) return no_such_joint(joint, arm);
  const JointKind kind = arm.kinematics.joint_kind(joint);
  const double lower_q = from_shown(kind, request.numbers[1]);
  const double upper_q = from_shown(kind, request.numbers[2]);
  const JointLimits& range = arm.joints[joint];
  if (lower_q < range.lower_q - kRounding_q || upper_q > range.upper_q + kRounding_q)
    return fmt::format("joint {}: the limits are outside the range of the profile", joint);
  const double position_q = start_.position_q[joint];
  if (position_q < lower_q - kRounding_q || position_q > upper_q + kRounding_q)
    return fmt::format("joint {} would stand outside these limits, at {}", joint,
                       shown_joint(kind, position_q));
  if (!settings_.soft_limits) settings_.soft_limits = ranges_of(arm);
  settings_.soft_limits->lower_q[joint] = std::max(lower_q, range.lower_q);
  settings_.soft_limits->upper_q[joint] = std::min(upper_q, range.upper_q);
  return std::nullopt;
}

std::optional<std::string> DryRun::set_frame(const Request& request) {
  if (request.verb == Verb::kFrames) {
    settings_.tool_frame.reset();
    settings_.base_frame.reset();
    return std::nullopt;
  }
  Pose frame = pose(request);
  const bool is_tool = request.verb == Verb::kTool;
  const auto refusal = is_tool ? check_tool_frame(profile_.arm.kinematics, frame) : check_base_frame(frame);
  if (refusal) return refusal->text;
  frame.orientation = normalised(frame.orientation);
  (is_tool ? settings_.tool_frame : settings_.base_frame) = frame;
  return std::nullopt;
}

}  // namespace corbot::cli
