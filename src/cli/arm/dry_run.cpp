// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/dry_run.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "cli/arm/plan_text.h"
#include "client/client.h"
#include "client/explain.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "corbot/arm/joint_units.h"
#include "planner/setting_rules.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::Request;
using client::Verb;

Profile profile_of(const std::string& file) {
  try {
    return load_profile(file);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

namespace {

std::array<double, 3> point(const Request& request, std::size_t first) {
  return {request.numbers[first], request.numbers[first + 1], request.numbers[first + 2]};
}

/// Returns P, raised by D.
std::array<double, 3> point_above(const Request& request) {
  std::array<double, 3> above = point(request, 0);
  above[2] += request.above_m;
  return above;
}

Quaternion orientation(std::span<const double> numbers) {
  const Corbot::Quaternion q = client::orientation_of(numbers);
  return {q.w, q.x, q.y, q.z};
}

/// Returns X Y Z, and an orientation if one is given.
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

/// Returns the reason of a motion's refusal with the hint that `run` and `move` add.
std::string hinted(const PlanRefusal& refusal) {
  const auto& [x, y, z] = refusal.target_m;
  return refusal.text + (refusal.kind == PlanRefusal::Kind::kUnreachable ? client::metres_hint(x, y, z) : "");
}

/// Returns the reason of a refusal.
std::optional<std::string> text_of(const std::optional<PlanRefusal>& refusal) {
  return refusal ? std::optional(refusal->text) : std::nullopt;
}

}  // namespace

DryRun::DryRun(const std::string& profile) : DryRun(profile_of(profile)) {}

DryRun::DryRun(Profile profile) : profile_(std::move(profile)), planner_(profile_.arm) {}

void DryRun::begin_at(std::span<const double> joints) {
  const ArmModel& arm = profile_.arm;
  if (joints.size() != arm.dof)
    throw Failure(
        ExitCode::kUsage,
        fmt::format("the profile '{}' has {} joints, but the robot has {}: give the robot's own profile",
                    profile_.name, static_cast<int>(arm.dof), joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i)
    start_.position_q[i] = from_shown(arm.kinematics.joint_kind(i), joints[i]);
  begins_ = "where the robot would be";
}

std::optional<std::string> DryRun::refusal_of(const Request& given) {
  plan_ = {};
  verb_ = given.verb;
  try {
    const Request request = client::with_joint_number(given, profile_.joint_names);
    return client::spec_of(request.verb).motion ? move(request) : set(request);
  } catch (const Failure& failure) {
    return failure.what();
  }
}

std::string DryRun::plan() const { return plan_text(rate::parts_of(profile_.arm, settings_, plan_), verb_); }

std::optional<std::string> DryRun::move(const Request& request) {
  const ArmModel& arm = profile_.arm;
  if (request.verb == Verb::kJoints && request.numbers.size() != arm.dof)
    return fmt::format("{} values, but the arm has {} joints", request.numbers.size(), arm.dof);
  plan_ = planner_.plan(start_, settings_, motion(request, arm));
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan_)) return hinted(*refusal);
  for (const Command& command : std::get<std::vector<Command>>(plan_)) {
    start_.position_q = command.end_q;
    if (command.kind == MotionKind::kGripper)
      start_.gripper = command.gripper.from + command.gripper.law.distance;
  }
  plans_.push_back(plan_);
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
      return std::nullopt;  // an override, on which the plan does not depend
  }
}

std::optional<std::string> DryRun::set_speed(const Request& request) {
  const double ratio = request.numbers[0] / 100.0;
  if (request.joint >= 0) {
    if (const auto refusal = check_joint_number(profile_.arm, request.joint)) return refusal->text;
    settings_.joint_speed_ratio[static_cast<std::size_t>(request.joint)] = ratio;
  } else if (request.all) {
    settings_.joint_speed_ratio.fill(ratio);
  } else {
    settings_.speed_ratio = ratio;
  }
  return std::nullopt;
}

std::optional<std::string> DryRun::set_orientation(const Request& request) {
  if (request.reset) {
    take_any_orientation(settings_);
    return std::nullopt;
  }
  const ArmModel& arm = profile_.arm;
  if (request.verb == Verb::kPitch) {
    const auto refusal = check_tool_pitch(arm.kinematics, request.numbers[0]);
    if (!refusal) take_tool_pitch(settings_, request.numbers[0]);
    return text_of(refusal);
  }
  const Quaternion wanted = orientation(request.numbers);
  const auto refusal = check_tool_orientation(arm, wanted);
  if (!refusal) take_tool_orientation(settings_, wanted);
  return text_of(refusal);
}

/// Sets the limits of one joint, like the client; the other joints keep theirs.
std::optional<std::string> DryRun::set_limit(const Request& request) {
  if (request.reset) {
    settings_.soft_limits.reset();
    return std::nullopt;
  }
  const ArmModel& arm = profile_.arm;
  if (const auto refusal = check_joint_number(arm, static_cast<int>(request.numbers[0])))
    return refusal->text;
  JointRanges shown = settings_.soft_limits.value_or(profile_ranges(arm));
  for (std::size_t i = 0; i < arm.dof; ++i) {
    shown.lower_q[i] = to_shown(arm.kinematics.joint_kind(i), shown.lower_q[i]);
    shown.upper_q[i] = to_shown(arm.kinematics.joint_kind(i), shown.upper_q[i]);
  }
  const auto joint = static_cast<std::size_t>(request.numbers[0]);
  shown.lower_q[joint] = request.numbers[1];
  shown.upper_q[joint] = request.numbers[2];
  const auto limits = soft_limits_of(arm, shown);
  if (const auto* refusal = std::get_if<PlanRefusal>(&limits)) return refusal->text;
  const auto& wanted = std::get<JointRanges>(limits);
  const auto refusal = check_stands_within(arm, wanted, start_.position_q);
  if (!refusal) settings_.soft_limits = wanted;
  return text_of(refusal);
}

std::optional<std::string> DryRun::set_frame(const Request& request) {
  if (request.verb == Verb::kFrames) {
    take_profile_frames(settings_);
    return std::nullopt;
  }
  const Pose frame = pose(request);
  const bool is_tool = request.verb == Verb::kTool;
  const auto refusal = is_tool ? check_tool_frame(profile_.arm.kinematics, frame) : check_base_frame(frame);
  if (!refusal) (is_tool ? take_tool_frame : take_base_frame)(settings_, frame);
  return text_of(refusal);
}

}  // namespace corbot::cli
