// SPDX-License-Identifier: Apache-2.0
#include "planner/plan/refusal.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "corbot/interface_words.h"
#include "corbot/motion/bounds.h"

namespace corbot {

PlanRefusal bad_parameter(std::string parameter, Quantity quantity, double value, double lower, double upper,
                          std::string text, int joint) {
  PlanRefusal refusal(PlanRefusal::Kind::kBadParameter, std::move(parameter), quantity);
  refusal.joint = joint;
  refusal.value = value;
  refusal.lower = lower;
  refusal.upper = upper;
  refusal.text = std::move(text);
  return refusal;
}

PlanRefusal unreachable(const std::array<double, 3>& point_m, const IkSolution& result,
                        const std::string& where) {
  PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "P", Quantity::kLength);
  refusal.value = result.distance_m;
  refusal.lower = result.least_m;
  refusal.upper = result.most_m;
  refusal.target_m = point_m;
  if (result.most_m == 0.0) {  // not a limit of two links
    refusal.lower = result.limit_m;
    refusal.upper = std::numeric_limits<double>::infinity();
    refusal.text = fmt::format(
        "{} ({:.6g}, {:.6g}, {:.6g}) m is too close to the base axis: {:.6g} m, allowed from {:.6g} m", where,
        point_m[0], point_m[1], point_m[2], result.distance_m, result.limit_m);
    return refusal;
  }
  refusal.text = fmt::format(
      "{} ({:.6g}, {:.6g}, {:.6g}) m is {}: the wrist would be {:.6g} m from the shoulder, allowed "
      "{:.6g} to {:.6g} m",
      where, point_m[0], point_m[1], point_m[2],
      result.status == IkStatus::kTooClose ? "too close" : kTooFarWords, result.distance_m, result.least_m,
      result.most_m);
  return refusal;
}

PlanRefusal not_found(const std::array<double, 3>& point_m, const numeric::NumericSolutions& searched) {
  PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "P", Quantity::kLength);
  refusal.value = searched.nearest_m;
  refusal.target_m = point_m;
  refusal.text = fmt::format(
      "no joints are found for the target ({:.6g}, {:.6g}, {:.6g}) m: the nearest of {} searches stays "
      "{:.3g} m and "
      "{:.3g} degrees away",
      point_m[0], point_m[1], point_m[2], searched.seeds, searched.nearest_m,
      to_degrees(searched.nearest_rad));
  return refusal;
}

std::string shown_joint(JointKind kind, double value_q) {
  return fmt::format("{:.6g} {}", to_shown(kind, value_q), unit_name(kind));
}

PlanRefusal joint_range(const ArmModel& model, std::size_t joint, double value_q, const std::string& where) {
  return joint_range(joint, model.kinematics.joint_kind(joint), value_q, model.joints[joint], where);
}

PlanRefusal joint_range(std::size_t joint, JointKind kind, double value_q, const JointLimits& limits,
                        const std::string& where) {
  PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, kJointRangeWord, Quantity::kJointValue);
  refusal.joint = static_cast<int>(joint);
  refusal.value = value_q;
  refusal.lower = limits.lower_q;
  refusal.upper = limits.upper_q;
  refusal.text =
      fmt::format("joint {} would be at {} {}, allowed {:.6g} to {}", joint, shown_joint(kind, value_q),
                  where, to_shown(kind, limits.lower_q), shown_joint(kind, limits.upper_q));
  return refusal;
}

PlanRefusal too_long(double duration_s) {
  PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, kDurationWord, Quantity::kTime);
  refusal.value = duration_s;
  refusal.upper = kLongestPlan_s;
  refusal.text = fmt::format("under the speed limits this motion takes {:.6g} s, allowed up to {:.6g} s",
                             duration_s, kLongestPlan_s);
  return refusal;
}

PlanRefusal follows_no_path(std::size_t dof, const std::array<double, 3>& target_m) {
  PlanRefusal refusal(PlanRefusal::Kind::kUnreachable, "kind", Quantity::kNumber);
  refusal.target_m = target_m;
  refusal.text =
      fmt::format("an arm of {} joints follows no lines and arcs: move its joints, or to a point", dof);
  return refusal;
}

std::optional<PlanRefusal> check_time(double t_s) {
  if (t_s >= 0.0 && t_s <= kLongestPlan_s) return std::nullopt;
  return bad_parameter("t", Quantity::kTime, t_s, 0.0, kLongestPlan_s,
                       fmt::format("t = {:.6g} s, allowed 0 to {:.6g} s", t_s, kLongestPlan_s));
}

std::optional<PlanRefusal> check_point(const std::array<double, 3>& point_m, const std::string& name) {
  static constexpr std::array<char, 3> kAxis{'x', 'y', 'z'};
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(point_m[i]) <= kFarthestCoordinate_m) continue;
    return bad_parameter(name, Quantity::kLength, point_m[i], -kFarthestCoordinate_m, kFarthestCoordinate_m,
                         fmt::format("{} of {} is {:.6g} m, allowed -{:.6g} to {:.6g} m", kAxis[i], name,
                                     point_m[i], kFarthestCoordinate_m, kFarthestCoordinate_m));
  }
  return std::nullopt;
}

std::optional<PlanRefusal> check_orientation(const Quaternion& orientation, const std::string& name,
                                             const std::string& what) {
  const std::array<std::pair<char, double>, 4> parts{
      {{'w', orientation.w}, {'x', orientation.x}, {'y', orientation.y}, {'z', orientation.z}}};
  constexpr double kUnitShortest = 1.0 - kUnitLengthTolerance;
  constexpr double kUnitLongest = 1.0 + kUnitLengthTolerance;
  for (const auto& [part, value] : parts) {
    if (std::isfinite(value)) continue;
    return bad_parameter(name, Quantity::kNumber, value, -kUnitLongest, kUnitLongest,
                         fmt::format("{} of {} is {}, allowed -1 to 1", part, what, value));
  }
  const double length = std::sqrt(squared_norm(orientation));
  if (length >= kUnitShortest && length <= kUnitLongest) return std::nullopt;
  return bad_parameter(name, Quantity::kNumber, length, kUnitShortest, kUnitLongest,
                       fmt::format("the quaternion of {} has length {:.6g}, allowed 1 within {:g}", what,
                                   length, kUnitLengthTolerance));
}

std::optional<PlanRefusal> check_pose(const Pose& pose, const std::string& name) {
  if (auto refusal = check_point(pose.position_m, name)) return refusal;
  return check_orientation(pose.orientation, name, "the orientation of " + name);
}

std::optional<PlanRefusal> check_tool(const PlanSettings& settings) {
  if (settings.tool_pitch_rad && !std::isfinite(*settings.tool_pitch_rad)) {
    return bad_parameter("tool pitch", Quantity::kAngle, *settings.tool_pitch_rad, -std::numbers::pi,
                         std::numbers::pi, "the tool pitch is not a finite number");
  }
  if (settings.tool_orientation)
    return check_orientation(*settings.tool_orientation, "orientation", "the orientation");
  return std::nullopt;
}

bool in_range(const JointLimits& limits, double value_q) noexcept {
  return value_q >= limits.lower_q - kRangeTolerance_q && value_q <= limits.upper_q + kRangeTolerance_q;
}

Command blank_command(MotionKind kind, const PlanStart& start) noexcept {
  Command command{};
  command.kind = kind;
  command.start_q = start.position_q;
  command.end_q = start.position_q;
  // The union's first member is the largest one, but not by contract. Clear the member that is used.
  switch (kind) {
    case MotionKind::kJoint:
      command.joint = {};
      break;
    case MotionKind::kLine:
      command.line = {};
      break;
    case MotionKind::kArc:
      command.arc = {};
      break;
    case MotionKind::kDwell:
      command.dwell = {};
      break;
    case MotionKind::kGripper:
      command.gripper = {};
      break;
  }
  return command;
}

}  // namespace corbot
